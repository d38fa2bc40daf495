#pragma once
#include <string>

#include "data/camera/camera.h"

namespace flash::data {

/// A lens as the text of a ROS camera_info YAML file, which load_camera_intrinsics() reads.
std::string camera_info_text(const CameraIntrinsics& camera, const std::string& name = "camera");

}  // namespace flash::data
