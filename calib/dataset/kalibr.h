#pragma once
#include <string>

#include "calib/dataset/target.h"

namespace flash::calib {

/// Kalibr's YAML of an aprilgrid or a checkerboard. Throws InputError.
Target load_kalibr_target(const std::string& path);

}  // namespace flash::calib
