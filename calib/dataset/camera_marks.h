#pragma once
#include <string>

namespace flash::calib {

/// The comments between which `export` puts a camera into a robot's description, without their delimiters.
/// Readers of the robot leave out what stands between them.
inline const std::string kCameraMark = " flash-calib: ", kCameraEndMark = " end of flash-calib: ";

}  // namespace flash::calib
