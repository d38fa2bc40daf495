#pragma once
#include <vector>

#include "data/mesh/mesh.h"

namespace flash::data {

/// Of each vertex, the first one that triangles join it with.
std::vector<int> first_of_part(const TriangleMesh& mesh);

/// The parts of a mesh whose triangles share no vertex, in order of their first vertex. Vertices of no
/// triangle are in none.
std::vector<TriangleMesh> connected_parts(const TriangleMesh& mesh);

}  // namespace flash::data
