#pragma once
#include <string>

#include "calib/geometry/setup.h"
#include "data/extrinsics.h"

namespace flash::calib {

/// `ros2 run tf2_ros static_transform_publisher --x ... --frame-id parent --child-frame-id child`
std::string ros_static_transform(const data::NamedTransform& transform);
/// A fixed joint, roll, pitch and yaw about fixed x, y, z.
std::string urdf_joint(const data::NamedTransform& transform);
/// easy_handeye2's calibration file.
std::string easy_handeye2(const data::NamedTransform& transform, Setup setup);

}  // namespace flash::calib
