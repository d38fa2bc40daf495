#include "data/mesh/delaunay.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>

namespace flash::data {
namespace {

using Triangle = std::array<int, 3>;

/// The corner of all triangles outside the hull: a vertex at infinity, so that hull edges need no rounding.
constexpr int kGhost = -1;

/// Points on a lattice of 2^30 steps along the longer side of their box: sums and products of its whole
/// numbers below are exact, which those of doubles are not.
using Node = Eigen::Matrix<std::int64_t, 2, 1>;
__extension__ using Exact = __int128;

std::vector<Node> nodes_of(const std::vector<Eigen::Vector2d>& points) {
  if (points.empty()) return {};
  Eigen::Vector2d low = points[0], high = points[0];
  for (const Eigen::Vector2d& point : points) {
    low = low.cwiseMin(point);
    high = high.cwiseMax(point);
  }
  const double steps = std::ldexp(1.0, 30) / (high - low).maxCoeff();
  std::vector<Node> nodes;
  for (const Eigen::Vector2d& point : points)
    nodes.emplace_back(std::llround(steps * (point - low).x()), std::llround(steps * (point - low).y()));
  return nodes;
}

/// Above zero where a, b, c turn counter-clockwise; at most 2^61.
std::int64_t turn(const Node& a, const Node& b, const Node& c) {
  return (b - a).x() * (c - a).y() - (b - a).y() * (c - a).x();
}

/// Whether p lies inside the circle through the counter-clockwise a, b, c; not on it. At most 2^124 is added
/// up.
bool in_circle(const Node& a, const Node& b, const Node& c, const Node& p) {
  return Exact(turn(p, b, c)) * (a - p).squaredNorm() + Exact(turn(p, c, a)) * (b - p).squaredNorm() +
             Exact(turn(p, a, b)) * (c - p).squaredNorm() >
         0;
}

}  // namespace

Triangles delaunay(const std::vector<Eigen::Vector2d>& points) {
  const int n = static_cast<int>(points.size());
  const std::vector<Node> nodes = nodes_of(points);
  const auto at = [&](int i) -> const Node& { return nodes[static_cast<std::size_t>(i)]; };
  int third = 2;
  while (third < n && turn(at(0), at(1), at(third)) == 0) ++third;
  if (third >= n) return {};

  const auto conflicts = [&](const Triangle& t, int p) {
    const std::size_t ghost = static_cast<std::size_t>(std::find(t.begin(), t.end(), kGhost) - t.begin());
    if (ghost == 3) return in_circle(at(t[0]), at(t[1]), at(t[2]), at(p));
    // The circle through two points and infinity is the half plane beyond the edge, and the edge itself.
    const Node &a = at(t[(ghost + 1) % 3]), &b = at(t[(ghost + 2) % 3]);
    const std::int64_t side = turn(a, b, at(p));
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
