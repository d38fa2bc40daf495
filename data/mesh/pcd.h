#pragma once
#include <string>
#include <string_view>

#include "data/mesh/mesh.h"

namespace flash::data {

/// PCD 0.7 clouds, DATA ascii, binary or binary_compressed (LZF); x, y, z in any type, other fields skipped.
/// Every point is returned, the holes of an organised cloud, which are NaN, too. Throws InputError naming
/// `source`.
Points parse_pcd(std::string_view bytes, const std::string& source);

/// Binary, float.
std::string format_pcd(const Points& points);

}  // namespace flash::data
