#pragma once
#include <string>

#include "data/camera/camera.h"

namespace flash::data {

/// The first camera of a Kalibr camchain: pinhole with radial-tangential distortion or none. Throws
/// InputError.
CameraIntrinsics load_camchain(const std::string& path);

}  // namespace flash::data
