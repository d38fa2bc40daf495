#pragma once
#include <string>
#include <vector>

#include "data/motion/pose_file.h"

namespace flash::data {

/// Poses of the gripper in the base, in the order of their pictures: the first of those stacks below, or the
/// only array. Throws InputError that names the arrays found.
PoseList load_npz_poses(const std::string& path);

/// The same of one array, as numpy.save writes it.
PoseList load_npy_poses(const std::string& path);

/// Pairs as numpy.savez writes two stacks of N poses: of the gripper in the base (robot, gripper, effector,
/// hand, T_base_gripper, T_base_ee) and of the target in the camera (target, tracking, object, board, marker,
/// T_camera_target, T_cam_board), each N x 4 x 4, N x 3 x 4 or N x 7 (x y z qx qy qz qw). Or as
/// calibrateHandEye of OpenCV takes them: R_gripper2base and R_target2cam, N x 3 x 3 or rotation vectors, N x
/// 3, t_gripper2base and t_target2cam, N x 3. Capitals and underscores do not count. Throws InputError that
/// names the arrays found.
std::vector<PosePair> load_npz_pairs(const std::string& path);

}  // namespace flash::data
