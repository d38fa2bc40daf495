#pragma once
#include <array>
#include <vector>

#include "sim/pairs/box_tree.h"
#include "sim/scene/sheet.h"

namespace flash::sim {

/// The surface of a sheet that meets itself: its triangles, edges and vertices, and the area that each stands
/// for. What it needs of the mesh alone.
struct PairSurface {
  explicit PairSurface(const Sheet& sheet);

  data::Points rest;  ///< all vertices of the sheet [m]
  data::Triangles triangles;
  std::vector<std::array<int, 2>> edges;  ///< of the triangles
  std::vector<double> vertex_area;        ///< a third of the triangles around it, at rest [m^2]
  std::vector<double> edge_width;         ///< a third of the triangles beside it over its length, at rest [m]
  std::vector<int> body;                  ///< of each vertex
  /// Vertices and edges that each triangle owns; -1: another one does. So each pair is found once.
  std::vector<std::array<int, 3>> own_vertices, own_edges;
  BoxTree tree;
};

}  // namespace flash::sim
