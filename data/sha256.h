#pragma once
#include <string>
#include <string_view>

namespace flash::data {

/// SHA-256 of some bytes, 64 hexadecimal digits (FIPS 180-4).
std::string sha256(std::string_view bytes);

}  // namespace flash::data
