#pragma once
#include <vector>

#include "calib/calibrate/calibrate.h"

namespace flash::calib {

/// calibrate() for views without points: views selected, convention checked, fit, held-out residuals in mm
/// and deg, comparison. Throws data::InputError as calibrate() does.
Calibration calibrate_pairs(Setup setup, const std::vector<Observation>& observations,
                            const CalibrateSettings& settings = {});

}  // namespace flash::calib
