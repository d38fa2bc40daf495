#pragma once
#include "calib/dataset/observation.h"

namespace flash::calib {

/// What corners scatter by where no intrinsics are known: 2-D rms per corner about the homography that fits
/// them best, over the degrees of freedom that it leaves [px]. What the lens bends counts as scatter. Zero
/// for four corners or fewer, which a homography fits exactly. target_points: the whole target's, flat, 3 x
/// N.
double plane_residual(const Eigen::Matrix3Xd& target_points, const Observation& observation);

}  // namespace flash::calib
