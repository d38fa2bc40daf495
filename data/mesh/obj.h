#pragma once
#include <string>
#include <string_view>

#include "data/mesh/mesh_io.h"

namespace flash::data {

/// Wavefront OBJ: `v` and `f` lines (v, v/vt, v//vn; negative indices count from the end), the rest is
/// skipped. Throws InputError naming `source` and the line.
Geometry parse_obj(std::string_view text, const std::string& source);
std::string format_obj(const TriangleMesh& mesh);

/// Tetrahedra, read likewise: lines `v x y z` and `t a b c d`, indices from 1.
Geometry parse_tet(std::string_view text, const std::string& source);
std::string format_tet(const TetMesh& mesh);

}  // namespace flash::data
