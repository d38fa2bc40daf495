#include "data/delaunay.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <utility>

namespace flash::data {
namespace {

using Triangle = std::array<int, 3>;

/// The corner of all triangles outside the hull: a vertex at infinity, so that hull edges need no rounding.
constexpr int kGhost = -1;

/// Above zero where a, b, c turn counter-clockwise; exactly zero for points on an axis-parallel line.
double turn(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c) {
  return (b - a).x() * (c - a).y() - (b - a).y() * (c - a).x();
}

/// Whether p lies inside the circle through the counter-clockwise a, b, c. Four points on a circle but for
/// rounding are left as they are: either diagonal is Delaunay.
bool in_circle(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c,
               const Eigen::Vector2d& p) {
  Eigen::Matrix3d m;
  m << (a - p).transpose(), (a - p).squaredNorm(), (b - p).transpose(), (b - p).squaredNorm(),
      (c - p).transpose(), (c - p).squaredNorm();
  return m.determinant() > 1e-12 * m.col(2).maxCoeff() * m.col(2).maxCoeff();
}

}  // namespace

Triangles delaunay(const std::vector<Eigen::Vector2d>& points) {
  const int n = static_cast<int>(points.size());
  const auto at = [&](int i) -> const Eigen::Vector2d& { return points[static_cast<std::size_t>(i)]; };
  int third = 2;
  while (third < n && turn(at(0), at(1), at(third)) == 0) ++third;
  if (third >= n) return {};

  const auto conflicts = [&](const Triangle& t, int p) {
    const std::size_t ghost = static_cast<std::size_t>(std::find(t.begin(), t.end(), kGhost) - t.begin());
    if (ghost == 3) return in_circle(at(t[0]), at(t[1]), at(t[2]), at(p));
    // The circle through two points and infinity is the half plane beyond the edge, and the edge itself.
    const Eigen::Vector2d &a = at(t[(ghost + 1) % 3]), &b = at(t[(ghost + 2) % 3]);
    const double side = turn(a, b, at(p));
    return side > 0 || (side == 0 && (at(p) - a).dot(at(p) - b) < 0);
  };

  Triangle first = {0, 1, third};
  if (turn(at(0), at(1), at(third)) < 0) std::swap(first[0], first[1]);
  std::vector<Triangle> triangles = {first};
  for (std::size_t k = 0; k < 3; ++k) triangles.push_back({first[(k + 1) % 3], first[k], kGhost});

  std::vector<std::pair<int, int>> cavity;
  for (int p = 2; p < n; ++p) {
    if (p == third) continue;
    const auto first_bad = std::partition(triangles.begin(), triangles.end(),
                                          [&](const Triangle& t) { return !conflicts(t, p); });
    cavity.clear();
    for (auto t = first_bad; t != triangles.end(); ++t)
      for (std::size_t k = 0; k < 3; ++k) cavity.emplace_back((*t)[k], (*t)[(k + 1) % 3]);
    triangles.erase(first_bad, triangles.end());
    for (const auto& [a, b] : cavity) {
      // An edge that two removed triangles share stands twice, once each way.
      const bool shared = std::find(cavity.begin(), cavity.end(), std::pair(b, a)) != cavity.end();
      if (!shared) triangles.push_back({a, b, p});
    }
  }

  std::vector<int> inner;
  for (const Triangle& t : triangles)
    if (std::find(t.begin(), t.end(), kGhost) == t.end()) inner.insert(inner.end(), t.begin(), t.end());
  return Eigen::Map<Triangles>(inner.data(), static_cast<Eigen::Index>(inner.size() / 3), 3);
}

}  // namespace flash::data
