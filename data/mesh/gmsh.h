#pragma once
#include <string>
#include <string_view>

#include "data/mesh/mesh_io.h"

namespace flash::data {

/// Gmsh meshes (.msh) of version 2.2, ascii, and 4.1, ascii or little-endian binary. Where there are
/// tetrahedra, the triangles of their surface and all points and lines are left out; else triangles and quads
/// count. Nodes keep their order, those of no element that counts left out. Throws InputError naming `source`
/// and the section: on counts larger than the file, nodes that are listed twice or not at all, and elements
/// of other shapes or a higher order.
Geometry parse_msh(std::string_view bytes, const std::string& source);

}  // namespace flash::data
