#pragma once
#include <string>

#include "calib/report/extrinsics_export.h"

namespace flash::calib {

/// A robot's description with the camera in it; nothing else of the text changes. What an earlier call put
/// there, between two comments that name the camera, is replaced.

/// URDF or xacro: a link of the camera's optical frame and the fixed joint that carries it, before the end of
/// the robot. `path` is for messages. Throws data::InputError where the text is no XML of a robot, has no
/// link of the parent's name (of xacro it may be made by a macro, and is not looked for), or has one of the
/// camera's that is not of an earlier call.
std::string camera_in_urdf(const std::string& text, const std::string& path,
                           const data::NamedTransform& transform, const Lens& lens = {});

/// MJCF: the camera, at the beginning of the body of the parent's name, or of the worldbody where that is
/// "world". Throws likewise.
std::string camera_in_mjcf(const std::string& text, const std::string& path,
                           const data::NamedTransform& transform, const Lens& lens = {});

}  // namespace flash::calib
