#pragma once
#include <optional>
#include <string>

#include "calib/geometry/setup.h"
#include "data/camera/extrinsics.h"

namespace flash::calib {

/// Exports for other programs. Each carries the lens that the transform holds with, where there is one, in a
/// comment that data::find_lens_remark reads.
using Lens = std::optional<data::CameraIntrinsics>;

/// `ros2 run tf2_ros static_transform_publisher --x ... --frame-id parent --child-frame-id child`
std::string ros_static_transform(const data::NamedTransform& transform, const Lens& lens = {});
/// A fixed joint, roll, pitch and yaw about fixed x, y, z.
std::string urdf_joint(const data::NamedTransform& transform, const Lens& lens = {});
/// easy_handeye2's calibration file. `other`: the frame of the robot that does not carry the camera; empty:
/// base, or gripper.
std::string easy_handeye2(const data::NamedTransform& transform, Setup setup, const Lens& lens = {},
                          const std::string& other = "");
/// A camera of MuJoCo's MJCF, which looks along -z with y up, in the body of the parent. Its lens has no
/// distortion.
std::string mjcf_camera(const data::NamedTransform& transform, const Lens& lens = {});
/// A stage of OpenUSD in metres, z up, with the camera in an Xform of the parent's name. It looks likewise,
/// and has no distortion either.
std::string usd_stage(const data::NamedTransform& transform, const Lens& lens = {});
/// YAML as cv::FileStorage reads it: camera_matrix, distortion_coefficients, image_width, image_height, and
/// T_parent_camera, 4 x 4.
std::string opencv_yaml(const data::NamedTransform& transform, const Lens& lens = {});

}  // namespace flash::calib
