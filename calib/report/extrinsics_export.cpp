#include "calib/report/extrinsics_export.h"

#include <cmath>
#include <cstdio>

#include "data/motion/trajectory.h"

namespace flash::calib {
namespace {

/// Roll, pitch, yaw about fixed x, y, z: R = Rz(yaw) Ry(pitch) Rx(roll).
Eigen::Vector3d roll_pitch_yaw(const Eigen::Matrix3d& R) {
  const double pitch = std::atan2(-R(2, 0), std::hypot(R(0, 0), R(1, 0)));
  // At a pitch of 90 deg only the sum or difference of the others counts: all of it becomes yaw.
  if (std::hypot(R(0, 0), R(1, 0)) < 1e-9) return {0, pitch, std::atan2(-R(0, 1), R(1, 1))};
  return {std::atan2(R(2, 1), R(2, 2)), pitch, std::atan2(R(1, 0), R(0, 0))};
}

template <class... Values>
std::string formatted(const char* format, const Values&... values) {
  char text[1024];
  std::snprintf(text, sizeof text, format, values...);
  return text;
}

/// The line of a comment between two marks; empty without a lens.
std::string remark(const char* begin, const Lens& lens, const char* end = "") {
  return lens ? std::string(begin) + data::lens_remark(*lens) + end + '\n' : std::string();
}

}  // namespace

std::string ros_static_transform(const data::NamedTransform& transform, const Lens& lens) {
  const Eigen::Matrix<double, 7, 1> v = data::to_vector(transform.T);
  return remark("# ", lens) + formatted(
                                  "ros2 run tf2_ros static_transform_publisher --x %.9g --y %.9g --z %.9g "
                                  "--qx %.9g --qy %.9g --qz %.9g "
                                  "--qw "
                                  "%.9g --frame-id %s --child-frame-id %s\n",
                                  v[0], v[1], v[2], v[3], v[4], v[5], v[6], transform.parent.c_str(),
                                  transform.child.c_str());
}

std::string urdf_joint(const data::NamedTransform& transform, const Lens& lens) {
  const Eigen::Vector3d t = transform.T.translation(), rpy = roll_pitch_yaw(transform.T.linear());
  return remark("<!-- ", lens, " -->") +
         formatted(
             "<joint name=\"%s_to_%s\" type=\"fixed\">\n  <parent link=\"%s\"/>\n  <child link=\"%s\"/>\n"
             "  <origin xyz=\"%.9g %.9g %.9g\" rpy=\"%.9g %.9g %.9g\"/>\n</joint>\n",
             transform.parent.c_str(), transform.child.c_str(), transform.parent.c_str(),
             transform.child.c_str(), t.x(), t.y(), t.z(), rpy.x(), rpy.y(), rpy.z());
}

std::string easy_handeye2(const data::NamedTransform& transform, Setup setup, const Lens& lens) {
  const Eigen::Matrix<double, 7, 1> v = data::to_vector(transform.T);
  const bool in_hand = setup == Setup::eye_in_hand;
  return remark("# ", lens) +
         formatted(
             "parameters:\n  name: flash_calib\n  calibration_type: %s\n  robot_base_frame: %s\n"
             "  robot_effector_frame: %s\n  tracking_base_frame: %s\n  tracking_marker_frame: target\n"
             "  freehand_robot_movement: true\n"
             "transform:\n  translation: {x: %.9g, y: %.9g, z: %.9g}\n"
             "  rotation: {x: %.9g, y: %.9g, z: %.9g, w: %.9g}\n",
             in_hand ? "eye_in_hand" : "eye_on_base", in_hand ? "base" : transform.parent.c_str(),
             in_hand ? transform.parent.c_str() : "gripper", transform.child.c_str(), v[0], v[1], v[2], v[3],
             v[4], v[5], v[6]);
}

}  // namespace flash::calib
