#pragma once
#include <string>

#include "calib/geometry/serial_chain.h"
#include "data/motion/pose_file.h"

namespace flash::calib {

/// A CSV of joints whose header names the columns: image, index or t as load_pose_list has them, and each
/// joint that moves by its name in the robot, or q1 q2 ... in their order [rad, m]; with the ending _deg in
/// degrees. The pose is that of the robot's last link. Throws data::InputError naming file and line.
data::PoseList load_joint_list(const std::string& path, const SerialChain& robot);

}  // namespace flash::calib
