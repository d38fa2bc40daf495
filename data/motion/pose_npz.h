#pragma once
#include <string>
#include <vector>

#include "data/motion/pose_file.h"

namespace flash::data {

/// Pairs as numpy.savez writes two stacks of N poses: of the gripper in the base (robot, gripper, effector,
/// hand, T_base_gripper) and of the target in the camera (target, tracking, object, board, marker,
/// T_camera_target), each N x 4 x 4, N x 3 x 4 or N x 7 (x y z qx qy qz qw). Or as calibrateHandEye of OpenCV
/// takes them: R_gripper2base and R_target2cam, N x 3 x 3, t_gripper2base and t_target2cam, N x 3. Capitals
/// and underscores do not count. Throws InputError that names the arrays found.
std::vector<PosePair> load_npz_pairs(const std::string& path);

}  // namespace flash::data
