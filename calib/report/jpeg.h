#pragma once
#include <string>

#include "data/picture/picture.h"

namespace flash::calib {

/// The bytes of a JPEG file: a tenth of a PNG of the same photograph.
std::string encode_jpeg(const data::Picture& picture);

}  // namespace flash::calib
