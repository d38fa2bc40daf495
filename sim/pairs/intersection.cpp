#include "sim/pairs/intersection.h"

#include <algorithm>

namespace flash::sim {

namespace {

using data::Points;
using Eigen::Vector3d;

/// Six times the volume of the tetrahedron a, b, c, d, in extended precision.
long double volume(const Vector3d& a, const Vector3d& b, const Vector3d& c, const Vector3d& d) {
  using Extended = Eigen::Matrix<long double, 3, 1>;
  const Extended u = (b.cast<long double>() - a.cast<long double>()),
                 v = (c.cast<long double>() - a.cast<long double>()),
                 w = (d.cast<long double>() - a.cast<long double>());
  return u[0] * (v[1] * w[2] - v[2] * w[1]) + u[1] * (v[2] * w[0] - v[0] * w[2]) +
         u[2] * (v[0] * w[1] - v[1] * w[0]);
}

bool edges_pass(const Points& x, const data::Triangles& triangles, int s, int t) {
  const Vector3d face[3] = {x.row(triangles(t, 0)), x.row(triangles(t, 1)), x.row(triangles(t, 2))};
  for (int k = 0; k < 3; ++k)
    if (passes(x.row(triangles(s, k)), x.row(triangles(s, (k + 1) % 3)), face)) return true;
  return false;
}

bool share_a_vertex(const data::Triangles& triangles, int s, int t) {
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      if (triangles(s, i) == triangles(t, j)) return true;
  return false;
}

}  // namespace

bool passes(const Vector3d& a, const Vector3d& b, const Vector3d* x) {
  const long double above = volume(x[0], x[1], x[2], a), below = volume(x[0], x[1], x[2], b);
  if (!(above * below < 0)) return false;
  const long double u = volume(a, b, x[0], x[1]), v = volume(a, b, x[1], x[2]), w = volume(a, b, x[2], x[0]);
  return (u > 0 && v > 0 && w > 0) || (u < 0 && v < 0 && w < 0);
}

std::optional<std::pair<int, int>> first_intersection(PairSurface& surface, const Points& positions) {
  std::vector<Bounds> boxes;
  for (Eigen::Index i = 0; i < positions.rows(); ++i) {
    const Eigen::Array3d place = positions.row(i).transpose().array();
    boxes.push_back({place, place});
  }
  surface.tree.refit(boxes);
  std::optional<std::pair<int, int>> found;
  constexpr double touching = 1e-12;  // [m]
  surface.tree.for_each_near(touching, [&](int s, int t) {
    const std::pair<int, int> both = std::minmax(s, t);
    if (share_a_vertex(surface.triangles, s, t) || (found && *found < both)) return;
    if (edges_pass(positions, surface.triangles, s, t) || edges_pass(positions, surface.triangles, t, s))
      found = both;
  });
  return found;
}

}  // namespace flash::sim
