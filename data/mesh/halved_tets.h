#pragma once
#include <array>
#include <vector>

#include "data/mesh/mesh.h"

namespace flash::data {

/// Tetrahedra of half the size that fill the same body.
struct HalvedTets {
  TetMesh mesh;                           ///< first the vertices as they were, then the middles of edges
  std::vector<std::array<int, 2>> edges;  ///< the ends of the edge that each middle is on
};

/// Splits each tetrahedron in eight: four at its corners, and four about the shortest diagonal of the
/// octahedron between them (Zhang 1995). All have an eighth of its volume.
HalvedTets halved(const TetMesh& mesh);

}  // namespace flash::data
