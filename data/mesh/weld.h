#pragma once
#include <cstddef>

#include "data/mesh/mesh.h"

namespace flash::data {

/// How many vertices stand exactly where an earlier one does.
std::size_t doubled_vertices(const Points& vertices);

/// Vertices at the same place become the first of them; those of no element go.
TriangleMesh welded(const TriangleMesh& mesh);
TetMesh welded(const TetMesh& mesh);

}  // namespace flash::data
