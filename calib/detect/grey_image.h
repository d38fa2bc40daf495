#pragma once
#include <cstdint>
#include <string>

#include "data/camera/depth_image.h"

namespace flash::calib {

using GreyImage = data::Image<std::uint8_t>;

/// 8-bit grey of a png or jpg. Throws InputError where it cannot be read.
GreyImage load_grey_image(const std::string& path);

/// "640 x 480".
std::string size_text(int width, int height);

}  // namespace flash::calib
