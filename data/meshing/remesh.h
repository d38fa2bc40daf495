#pragma once
#include "data/mesh/mesh.h"

namespace flash::data {

/// Edges of triangles against what was asked.
struct EdgeLengths {
  double least = 0, mean = 0, largest = 0;  ///< [m]
};
EdgeLengths edge_lengths(const TriangleMesh& mesh);

/// The same surface in nearly equilateral triangles of the edge length `edge` [m]: edges are split above 4/3
/// of it, collapsed below 4/5 and flipped to Delaunay's, and vertices relax along the surface, all of it ten
/// times (Botsch and Kobbelt 2004). Vertices stay on the given surface, those of a border on the border.
/// Where that turns by more than 50 degrees within an edge length is a corner, which stays. The surface is
/// one as checked_surface returns; folds sharper than the edge length are rounded.
TriangleMesh remeshed(const TriangleMesh& mesh, double edge);

}  // namespace flash::data
