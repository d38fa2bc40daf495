#pragma once
#include <string>
#include <string_view>

#include "data/mesh.h"

namespace flash::data {

/// PCD 0.7 clouds, DATA ascii or binary; x, y, z in any type, other fields skipped, non-finite points (how
/// PCD marks the holes of an organised cloud) dropped. Throws InputError naming `source`.
Points parse_pcd(std::string_view bytes, const std::string& source);

/// Binary, float.
std::string format_pcd(const Points& points);

}  // namespace flash::data
