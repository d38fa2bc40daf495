#pragma once
#include <functional>
#include <vector>

#include "calib/calibrate/calibrate.h"

namespace flash::calib {

/// Solves views with all that is seen taken to have stood still. Throws data::InputError as `calibrate` does.
using StillSolver = std::function<Calibration(const std::vector<Observation>&)>;

/// The answer where camera or target may have moved during the recording, in one step or all the time. A step
/// parts the views, and those of one side count; a drift is solved for. What explains the views in time best,
/// by the likelihood less the price of its unknowns, is told. Views are in the order of time.
/// points: the target's.
Calibration calibrate_moving(const std::vector<Observation>& all, const Eigen::Matrix3Xd& points,
                             const StillSolver& solve);

}  // namespace flash::calib
