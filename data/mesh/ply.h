#pragma once
#include <string>
#include <string_view>

#include "data/mesh/mesh_io.h"

namespace flash::data {

/// PLY 1.0, ascii or binary of either byte order: x, y, z of `vertex` and the index list of `face`, in any
/// number type; other properties and elements are skipped. Throws InputError naming `source`.
Geometry parse_ply(std::string_view bytes, const std::string& source);

enum class PlyNumbers { float32, float64 };

/// Binary little endian.
std::string format_ply(const Points& points, const Triangles& triangles, PlyNumbers numbers);

}  // namespace flash::data
