#pragma once
#include <string>

#include "calib/dataset/target.h"
#include "data/camera.h"

namespace flash::calib {

/// The first camera of a Kalibr camchain: pinhole with radial-tangential distortion or none. Throws
/// InputError.
data::CameraIntrinsics load_camchain(const std::string& path);

/// Kalibr's YAML of an aprilgrid or a checkerboard. Throws InputError.
Target load_kalibr_target(const std::string& path);

}  // namespace flash::calib
