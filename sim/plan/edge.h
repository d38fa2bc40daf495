#pragma once
#include <Eigen/Core>
#include <vector>

#include "sim/scene/sheet.h"

namespace flash::sim {

/// An edge of the rest mesh with the triangles on its two sides.
struct Edge {
  int a, b;                 ///< end vertices, as triangle `left` runs through them
  int left;                 ///< triangle that contains a -> b
  int right = -1;           ///< triangle that contains b -> a; -1 on the boundary
  int opposite_left;        ///< vertex of `left` not on the edge
  int opposite_right = -1;  ///< vertex of `right` not on the edge; -1 on the boundary
};

/// Every edge once, ordered by (min vertex, max vertex). Throws data::InputError where three triangles share
/// an edge or where neighbours are oriented against each other.
std::vector<Edge> sheet_edges(const Sheet& sheet);

}  // namespace flash::sim
