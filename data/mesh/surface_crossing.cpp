#include "data/mesh/surface_crossing.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "data/mesh/box_tree.h"

namespace flash::data {
namespace {

using Eigen::Vector2d;
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

struct Triangle {
  std::array<Vector3d, 3> x;
  Vector3d normal;  ///< unit
  double longest;   ///< edge

  double height(const Vector3d& point) const { return normal.dot(point - x[0]); }
};

Triangle triangle_of(const TriangleMesh& mesh, int t) {
  Triangle made;
  for (int k = 0; k < 3; ++k) made.x[std::size_t(k)] = mesh.vertices.row(mesh.triangles(t, k));
  const auto& [a, b, c] = made.x;
  made.normal = (b - a).cross(c - a).normalized();
  made.longest = std::max({(b - a).norm(), (c - b).norm(), (a - c).norm()});
  return made;
}

/// What is rounding in a pair, where the mesh has places up to `extent`.
double slack_of(const Triangle& s, const Triangle& t, double extent) {
  return std::min(1e-6 * extent, 1e-3 * std::min(s.longest, t.longest));
}

/// Whether the segment from a to b meets the triangle and reaches farther than `slack` to both sides of it.
bool crosses(const Vector3d& a, const Vector3d& b, const Triangle& t, double slack) {
  const double above = t.height(a), below = t.height(b);
  if (!(above * below < 0 && std::min(std::abs(above), std::abs(below)) > slack)) return false;
  const auto& x = t.x;
  const long double u = volume(a, b, x[0], x[1]), v = volume(a, b, x[1], x[2]), w = volume(a, b, x[2], x[0]);
  return (u >= 0 && v >= 0 && w >= 0) || (u <= 0 && v <= 0 && w <= 0);
}

/// Whether an edge of s that has no end in common with t crosses t.
bool edges_cross(const TriangleMesh& mesh, int s, int t, const Triangle& first, const Triangle& second,
                 double slack) {
  const auto is_of_second = [&](int vertex) { return (mesh.triangles.row(t).array() == vertex).any(); };
  for (int k = 0; k < 3; ++k) {
    const int l = (k + 1) % 3;
    if (!is_of_second(mesh.triangles(s, k)) && !is_of_second(mesh.triangles(s, l)) &&
        crosses(first.x[std::size_t(k)], first.x[std::size_t(l)], second, slack))
      return true;
  }
  return false;
}

int common_vertices(const Triangles& triangles, int s, int t) {
  int count = 0;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) count += triangles(s, i) == triangles(t, j);
  return count;
}

/// Area that s and t, seen along the normal of s, have in common: s cut by the sides of t (Sutherland and
/// Hodgman 1974).
double common_area(const Triangle& s, const Triangle& t) {
  const Vector3d along = (s.x[1] - s.x[0]).normalized(), across = s.normal.cross(along);
  const auto seen = [&](const Vector3d& x) {
    return Vector2d(along.dot(x - s.x[0]), across.dot(x - s.x[0]));
  };
  const auto cross = [](const Vector2d& a, const Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); };
  std::array<Vector2d, 3> window = {seen(t.x[0]), seen(t.x[1]), seen(t.x[2])};
  if (cross(window[1] - window[0], window[2] - window[0]) < 0) std::swap(window[1], window[2]);
  std::vector<Vector2d> polygon = {seen(s.x[0]), seen(s.x[1]), seen(s.x[2])};
  for (std::size_t k = 0; k < 3 && !polygon.empty(); ++k) {
    const Vector2d from = window[k], side = window[(k + 1) % 3] - from;
    std::vector<Vector2d> kept;
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      const Vector2d &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
      const double in_a = cross(side, a - from), in_b = cross(side, b - from);
      if (in_a >= 0) kept.push_back(a);
      if (in_a * in_b < 0) kept.push_back(a + in_a / (in_a - in_b) * (b - a));
    }
    polygon = std::move(kept);
  }
  double twice = 0;
  for (std::size_t i = 2; i < polygon.size(); ++i)
    twice += cross(polygon[i - 1] - polygon[0], polygon[i] - polygon[0]);
  return std::abs(twice) / 2;
}

double area_of(const Triangle& t) { return 0.5 * (t.x[1] - t.x[0]).cross(t.x[2] - t.x[0]).norm(); }

bool cover(const Triangle& s, const Triangle& t, double slack) {
  for (const Vector3d& x : t.x)
    if (!(std::abs(s.height(x)) <= slack)) return false;
  for (const Vector3d& x : s.x)
    if (!(std::abs(t.height(x)) <= slack)) return false;
  return common_area(s, t) > 1e-3 * std::min(area_of(s), area_of(t));
}

/// The least pair for which `is_one(s, t, slack)` holds, of triangles whose boxes meet.
template <class Test>
std::optional<TrianglePair> first_pair(const TriangleMesh& mesh, const Test& is_one) {
  if (mesh.triangles.rows() == 0) return {};
  std::vector<Bounds> boxes;
  for (Eigen::Index i = 0; i < mesh.vertices.rows(); ++i) {
    const Eigen::Array3d place = mesh.vertices.row(i).transpose().array();
    boxes.push_back({place, place});
  }
  const std::vector<int> one_group(static_cast<std::size_t>(mesh.triangles.rows()), 0);
  BoxTree tree(mesh.triangles, mesh.vertices, one_group);
  tree.refit(boxes);
  const double extent = mesh.vertices.cwiseAbs().maxCoeff();
  std::optional<TrianglePair> found;
  tree.for_each_near(1e-6 * extent, [&](int s, int t) {
    const TrianglePair both = std::minmax(s, t);
    if (found && *found < both) return;
    if (is_one(both.first, both.second, extent)) found = both;
  });
  return found;
}

}  // namespace

bool passes(const Vector3d& a, const Vector3d& b, const Vector3d* x) {
  const long double above = volume(x[0], x[1], x[2], a), below = volume(x[0], x[1], x[2], b);
  if (!(above * below < 0)) return false;
  const long double u = volume(a, b, x[0], x[1]), v = volume(a, b, x[1], x[2]), w = volume(a, b, x[2], x[0]);
  return (u > 0 && v > 0 && w > 0) || (u < 0 && v < 0 && w < 0);
}

std::optional<TrianglePair> first_crossing(const TriangleMesh& mesh, std::span<const int> part) {
  return first_pair(mesh, [&](int s, int t, double extent) {
    if (!part.empty() && part[std::size_t(mesh.triangles(s, 0))] != part[std::size_t(mesh.triangles(t, 0))])
      return false;
    if (common_vertices(mesh.triangles, s, t) > 1) return false;
    const Triangle first = triangle_of(mesh, s), second = triangle_of(mesh, t);
    const double slack = slack_of(first, second, extent);
    return edges_cross(mesh, s, t, first, second, slack) || edges_cross(mesh, t, s, second, first, slack);
  });
}

std::optional<TrianglePair> first_cover(const TriangleMesh& mesh) {
  return first_pair(mesh, [&](int s, int t, double extent) {
    const Triangle first = triangle_of(mesh, s), second = triangle_of(mesh, t);
    return cover(first, second, slack_of(first, second, extent));
  });
}

}  // namespace flash::data
