#pragma once
#include <Eigen/Geometry>
#include <vector>

#include "calib/calibrate/calibrate.h"

namespace flash::calib {

/// Refuses input that closes only when it is read otherwise than stated, or not at all. Throws
/// data::InputError with the one sentence that names the cause.
void expect_convention(Setup setup, const std::vector<Observation>& observations,
                       const std::vector<Symmetry>& symmetries, const RobustSeed& stated,
                       const CalibrateSettings& settings);

/// Refuses a robot whose poses are all the same.
void expect_motion(const std::vector<Eigen::Isometry3d>& T_base_gripper);

}  // namespace flash::calib
