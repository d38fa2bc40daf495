#pragma once
#include <string>
#include <vector>

#include "data/motion/pose_file.h"

namespace flash::data {

/// A JSON list of poses, or an object with one below `poses`, `samples`, `data` or `frames`. A pose is a 4 x
/// 4 matrix, as rows or flat; x y z qx qy qz qw; {x, y, z, qx, qy, qz, qw}; {position, orientation} or
/// {translation, rotation} with a quaternion of named parts or x y z w, or a 3 x 3 matrix; any of these below
/// `pose`, `matrix`, `transform` or `T_base_gripper`. Beside it stands the picture's name (image, file,
/// filename, name) or number (index, id, frame) or time (t, timestamp, time, stamp), or nothing. Throws
/// InputError.
PoseList load_json_poses(const std::string& path);

/// A JSON list of pairs: two poses each, the gripper in the world and the target in the camera, or an object
/// with one below robot, gripper, effector, hand or T_base_gripper, the other below tracking, target, object,
/// board, marker or T_camera_target. Throws InputError.
std::vector<PosePair> load_json_pairs(const std::string& path);

}  // namespace flash::data
