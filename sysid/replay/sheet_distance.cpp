#include "sysid/replay/sheet_distance.h"

#include <algorithm>
#include <limits>
#include <map>
#include <utility>

namespace flash::sysid {

SheetDistance::SheetDistance(const data::Triangles& triangles, const data::Points& layout)
    : triangles_(triangles), surface_(triangles, layout) {
  std::map<std::pair<int, int>, std::vector<std::pair<int, int>>> edges;  // ends -> (triangle, first corner)
  for (int t = 0; t < triangles.rows(); ++t)
    for (int k = 0; k < 3; ++k)
      edges[std::minmax(triangles(t, k), triangles(t, (k + 1) % 3))].emplace_back(t, k);
  for (const auto& [ends, places] : edges)
    if (places.size() == 1) border_.push_back({places[0].first, places[0].second, {}, {}});
  move(layout);
}

void SheetDistance::move(const data::Points& positions) {
  surface_.move(positions);
  move_border(positions);
}

void SheetDistance::move_border(const data::Points& positions) {
  positions_ = positions;
  for (BorderEdge& edge : border_) {
    edge.a = positions.row(triangles_(edge.triangle, edge.first));
    edge.ab = positions.row(triangles_(edge.triangle, (edge.first + 1) % 3)).transpose() - edge.a;
    const double squared = edge.ab.squaredNorm();
    edge.inverse_squared = squared > 0 ? 1 / squared : 0;
  }
}

SurfacePoint SheetDistance::nearest_on_border(const Eigen::Vector3d& query) const {
  SurfacePoint result;
  double best = std::numeric_limits<double>::infinity();
  for (const BorderEdge& edge : border_) {
    const Eigen::Vector3d from_a = query - edge.a;
    const double s = std::clamp(edge.ab.dot(from_a) * edge.inverse_squared, 0.0, 1.0);
    const double squared = (from_a - s * edge.ab).squaredNorm();
    if (squared >= best) continue;
    best = squared;
    result.triangle = edge.triangle;
    result.barycentric.setZero();
    result.barycentric[edge.first] = 1 - s;
    result.barycentric[(edge.first + 1) % 3] = s;
    result.position = edge.a + s * edge.ab;
  }
  result.distance = (query - result.position).norm();
  return result;
}

SurfacePoint SheetDistance::mark(const Mark& mark, const Eigen::Vector3d& query) const {
  SurfacePoint result;
  result.triangle = mark.triangle;
  result.barycentric = mark.barycentric;
  result.position = mark_position(mark, corners_of(positions_, triangles_, mark.triangle));
  result.distance = (query - result.position).norm();
  return result;
}

}  // namespace flash::sysid
