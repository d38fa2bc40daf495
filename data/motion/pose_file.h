#pragma once
#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <vector>

namespace flash::data {

/// A pose of the robot as a file gives it.
struct RecordedPose {
  std::string image;  ///< file name of the picture it belongs to, where the file says so
  double stamp = 0;   ///< number of the picture, or its time [s]
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  std::optional<Eigen::Vector3d> angles = {};  ///< as written, where the rotation came as three angles [rad]
  Eigen::VectorXd joints = {};                 ///< where the pose came as joints of a robot [rad, m]
};

struct PoseList {
  std::vector<RecordedPose> poses;
  bool in_order = false;  ///< without names or numbers: each belongs to the picture at its place
  bool timed = false;     ///< stamps are times, as the file says [s]
  std::string guess;      ///< how numbers without a name were read; empty: all have one
};

/// Robot and target seen from the camera at the same moment, without a picture.
struct PosePair {
  Eigen::Isometry3d T_base_gripper = Eigen::Isometry3d::Identity();
  Eigen::Isometry3d T_camera_target = Eigen::Isometry3d::Identity();
};

/// TUM lines `stamp tx ty tz qx qy qz qw`, or a CSV whose header names the columns: image, or index, or t
/// (also timestamp; EuRoC's in nanoseconds); tx ty tz (or x y z); qx qy qz qw, or rx ry rz (roll, pitch, yaw
/// about fixed x, y, z [rad]; with the ending _deg in degrees), or rotvec_x rotvec_y rotvec_z [rad]. Throws
/// InputError naming file and line: numbers missing, quaternions that are not unit to 1e-3, angles beyond a
/// turn (degrees), translations of many metres (millimetres). Other numbers are bare (load_bare_poses). JSON
/// as load_json_poses reads it; .npz and .npy (load_npz_poses); the robot's poses of `.samples`.
PoseList load_pose_list(const std::string& path);

/// Eight numbers a line parted by blanks, or a name that ends in .tum.
bool is_tum(const std::string& path);

/// One pose in YAML: x y z qx qy qz qw; position and orientation, or translation and rotation, of named
/// parts; a 4 x 4 matrix as {rows, cols, data} or a list of lists; ViSP's vector of translation and axis
/// times angle; also below `transform` or `pose`, as in easy_handeye2's calibrations. Throws InputError.
Eigen::Isometry3d load_yaml_pose(const std::string& path);

/// The same with the last number in the file name as its stamp.
RecordedPose load_pose_yaml(const std::string& path);

/// easy_handeye2 `.samples` (robot, tracking) or JSON: MoveIt's `pose_samples.json` (effector in the world,
/// object in the sensor) and others (load_json_pairs), or .npz (load_npz_pairs). Throws InputError.
std::vector<PosePair> load_pose_pairs(const std::string& path);

/// The last whole number in a file name without its folder and ending: "frame_000012.png" is 12.
std::optional<long> number_in_name(const std::string& path);

}  // namespace flash::data
