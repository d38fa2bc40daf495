#pragma once
#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <vector>

#include "data/camera/camera.h"

namespace flash::data {

class JsonObject;

/// A transform between two named frames.
struct NamedTransform {
  std::string parent, child;
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();  ///< maps points of the child into the parent
};

/// What every reader of extrinsics needs: where the camera is, with which lens, and what `flash-calib
/// handeye` said of its own answer.
struct CameraPose {
  NamedTransform transform;                     ///< base or gripper <- camera
  std::optional<CameraIntrinsics> lens = {};    ///< that the transform holds with; none of pairs of poses
  std::optional<CameraIntrinsics> stated = {};  ///< that the calibration began with, where the file says so
  std::vector<std::string> warnings;            ///< of the calibration, worst first
  bool usable = true;                           ///< false: it ended with exit code 3
};

/// `accept_unusable` is what --despite-doubts says. Without it an answer that cannot be used is refused.
/// Throws InputError naming file, field, what was found and what was expected, also where the names of the
/// frames are those of the inverse, a robot's frame in the camera, and where one number of the pose is not
/// told (one_axis).
CameraPose read_camera_pose(const JsonObject& file, bool accept_unusable);

/// T_base_camera of a camera that stands still: such a file; a trajectory or list of poses (load_pose_list),
/// whose first pose counts; or one pose in YAML, as easy_handeye2's .calib. The lens is that of the file, or
/// of a remark in it (lens_remark). A camera on the gripper is refused too.
CameraPose load_camera_pose(const std::string& path, bool accept_unusable);

/// Throws InputError, naming `path`, where a camera is farther from the robot's frame than any of a cell is,
/// 20 m: mostly these are millimetres. load_camera_pose does so itself.
void expect_near(const std::string& path, const Eigen::Isometry3d& camera);

/// The field "warnings" of a calibration, or of what was made with one; empty where it is absent.
std::vector<std::string> read_warnings(const JsonObject& file);

/// A lens as exports carry it in a comment: lens {"size_px": ..., "focal_px": ..., "centre_px": ...,
/// "distortion": ...}, the fields of `lens` in extrinsics.
std::string lens_remark(const CameraIntrinsics& lens);

/// The lens of the first such remark in a file's text; none where it has none. Throws InputError.
std::optional<CameraIntrinsics> find_lens_remark(const std::string& text, const std::string& path);

/// {"parent", "child", "translation": [x, y, z], "rotation_xyzw": [...]}
NamedTransform read_transform(const JsonObject& object);

}  // namespace flash::data
