#include "sim/pairs/intersection.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace flash::sim {

namespace {

using data::Points;
using Eigen::Vector3d;

/// Six times the volume of the tetrahedron a, b, c, d, in extended precision; 0 where it may be rounding
/// alone.
long double volume(const Vector3d& a, const Vector3d& b, const Vector3d& c, const Vector3d& d) {
  using Extended = Eigen::Matrix<long double, 3, 1>;
  const Extended u = (b.cast<long double>() - a.cast<long double>()),
                 v = (c.cast<long double>() - a.cast<long double>()),
                 w = (d.cast<long double>() - a.cast<long double>());
  const long double found = u[0] * (v[1] * w[2] - v[2] * w[1]) + u[1] * (v[2] * w[0] - v[0] * w[2]) +
                            u[2] * (v[0] * w[1] - v[1] * w[0]);
  const long double rounding =
      8 * std::numeric_limits<long double>::epsilon() * u.norm() * v.norm() * w.norm();
  return std::abs(found) <= rounding ? 0 : found;
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

std::optional<std::pair<int, int>> first_enclosed(const Sheet& sheet, const PairSurface& surface,
                                                  const Points& positions) {
  const Vector3d low = positions.colwise().minCoeff(), high = positions.colwise().maxCoeff();
  // Askew, so that it meets no edge of a mesh in rows.
  const Vector3d far = Vector3d(0.8164, 0.4387, 0.3754) * 4 * (high - low).norm();
  const int bodies = static_cast<int>(sheet.bodies.size());
  for (int inner = 0; inner < bodies; ++inner) {
    std::vector<int> leaves(sheet.bodies.size(), 0);
    int seen = -1;  // a vertex of the surface of the inner body
    for (Eigen::Index t = 0; t < surface.triangles.rows() && seen < 0; ++t)
      if (surface.body[static_cast<std::size_t>(surface.triangles(t, 0))] == inner)
        seen = surface.triangles(t, 0);
    if (seen < 0) continue;
    const Vector3d from = positions.row(seen), to = from + far;
    for (Eigen::Index t = 0; t < surface.triangles.rows(); ++t) {
      const int outer = surface.body[static_cast<std::size_t>(surface.triangles(t, 0))];
      if (outer == inner || !sheet.bodies[static_cast<std::size_t>(outer)].is_solid()) continue;
      const Vector3d face[3] = {positions.row(surface.triangles(t, 0)),
                                positions.row(surface.triangles(t, 1)),
                                positions.row(surface.triangles(t, 2))};
      leaves[static_cast<std::size_t>(outer)] += passes(from, to, face);
    }
    for (int outer = 0; outer < bodies; ++outer)
      if (leaves[static_cast<std::size_t>(outer)] % 2 == 1) return {{inner, outer}};
  }
  return {};
}

}  // namespace flash::sim
