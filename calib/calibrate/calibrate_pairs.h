#pragma once
#include <cstddef>
#include <vector>

#include "calib/calibrate/calibrate.h"

namespace flash::calib {

/// Of the comparison with closed forms, whose cost grows with the square of their number.
inline constexpr std::size_t most_pairs_compared = 200;

/// calibrate() for views without points: views selected, convention checked, fit, held-out residuals in mm
/// and deg, comparison. The cost grows with the number of pairs. Throws data::InputError as calibrate() does.
Calibration calibrate_pairs(Setup setup, const std::vector<Observation>& observations,
                            const CalibrateSettings& settings = {});

}  // namespace flash::calib
