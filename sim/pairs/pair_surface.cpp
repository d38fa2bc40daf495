#include "sim/pairs/pair_surface.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <map>

namespace flash::sim {

namespace {

/// The body of the first vertex of each triangle.
std::vector<int> triangle_bodies(const Sheet& sheet, const data::Triangles& triangles) {
  std::vector<int> bodies;
  for (Eigen::Index t = 0; t < triangles.rows(); ++t) bodies.push_back(body_of(sheet, triangles(t, 0)));
  return bodies;
}

}  // namespace

PairSurface::PairSurface(const Sheet& sheet)
    : rest(sheet.rest.vertices),
      triangles(visible_triangles(sheet)),
      vertex_area(static_cast<std::size_t>(rest.rows()), 0.0),
      own_vertices(static_cast<std::size_t>(triangles.rows()), {-1, -1, -1}),
      own_edges(own_vertices),
      tree(triangles, rest, triangle_bodies(sheet, triangles)) {
  for (Eigen::Index i = 0; i < rest.rows(); ++i) body.push_back(body_of(sheet, static_cast<int>(i)));
  std::vector<bool> owned(vertex_area.size(), false);
  std::map<std::array<int, 2>, std::size_t> index;
  for (Eigen::Index t = 0; t < triangles.rows(); ++t) {
    const Eigen::Vector3d a = rest.row(triangles(t, 0)), b = rest.row(triangles(t, 1)),
                          c = rest.row(triangles(t, 2));
    const double third = (b - a).cross(c - a).norm() / 6;
    for (int k = 0; k < 3; ++k) {
      const int v = triangles(t, k), w = triangles(t, (k + 1) % 3);
      vertex_area[v] += third;
      if (!owned[v]) own_vertices[t][k] = v;
      owned[v] = true;
      const std::array<int, 2> edge = {std::min(v, w), std::max(v, w)};
      const auto [place, fresh] = index.try_emplace(edge, edges.size());
      if (fresh) {
        own_edges[t][k] = static_cast<int>(edges.size());
        edges.push_back(edge);
        edge_width.push_back(0);
      }
      edge_width[place->second] += third / (rest.row(v) - rest.row(w)).norm();
    }
  }
}

}  // namespace flash::sim
