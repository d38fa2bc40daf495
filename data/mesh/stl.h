#pragma once
#include <string>
#include <string_view>

#include "data/mesh/mesh_io.h"

namespace flash::data {

/// STL, ascii or binary: facets of three corners; corners at the same coordinates become one vertex, in order
/// of first appearance. Normals and attributes are skipped. STL carries no unit: coordinates are read as
/// metres. Throws InputError naming `source` and the line, or the sizes of a binary file that does not hold
/// its facets.
Geometry parse_stl(std::string_view bytes, const std::string& source);

}  // namespace flash::data
