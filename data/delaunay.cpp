#include "data/delaunay.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <utility>

namespace flash::data {
namespace {

using Triangle = std::array<int, 3>;

double twice_area(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c) {
  return (b - a).x() * (c - a).y() - (b - a).y() * (c - a).x();
}

/// Whether p lies inside the circle through the counter-clockwise a, b, c.
bool in_circle(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c,
               const Eigen::Vector2d& p) {
  Eigen::Matrix3d m;
  m << a - p, b - p, c - p,
      Eigen::RowVector3d((a - p).squaredNorm(), (b - p).squaredNorm(), (c - p).squaredNorm());
  return m.determinant() > 0;
}

}  // namespace

Triangles delaunay(const std::vector<Eigen::Vector2d>& points) {
  if (points.size() < 3) return {};
  Eigen::Vector2d low = points[0], high = points[0];
  for (const Eigen::Vector2d& p : points) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  // One triangle around everything, far enough that its corners hardly bend the hull.
  const Eigen::Vector2d centre = (low + high) / 2;
  const double reach = 1e3 * (high - low).norm();
  std::vector<Eigen::Vector2d> x = points;
  const int n = static_cast<int>(points.size());
  x.push_back(centre + reach * Eigen::Vector2d(-2, -1));
  x.push_back(centre + reach * Eigen::Vector2d(2, -1));
  x.push_back(centre + reach * Eigen::Vector2d(0, 2));
  const auto at = [&](int i) -> const Eigen::Vector2d& { return x[static_cast<std::size_t>(i)]; };

  std::vector<Triangle> triangles = {{n, n + 1, n + 2}};
  for (int p = 0; p < n; ++p) {
    std::vector<std::pair<int, int>> cavity;
    const auto first_bad = std::partition(triangles.begin(), triangles.end(), [&](const Triangle& t) {
      return !in_circle(at(t[0]), at(t[1]), at(t[2]), at(p));
    });
    for (auto t = first_bad; t != triangles.end(); ++t)
      for (std::size_t k = 0; k < 3; ++k) cavity.emplace_back((*t)[k], (*t)[(k + 1) % 3]);
    triangles.erase(first_bad, triangles.end());
    for (const auto& [a, b] : cavity) {
      // An edge that two removed triangles share stands twice, once each way.
      const bool shared = std::find(cavity.begin(), cavity.end(), std::pair(b, a)) != cavity.end();
      if (!shared) triangles.push_back({a, b, p});
    }
  }

  std::vector<int> kept;
  for (const Triangle& t : triangles) {
    if (std::any_of(t.begin(), t.end(), [&](int i) { return i >= n; })) continue;
    const double longest = std::max({(at(t[0]) - at(t[1])).squaredNorm(), (at(t[1]) - at(t[2])).squaredNorm(),
                                     (at(t[2]) - at(t[0])).squaredNorm()});
    if (twice_area(at(t[0]), at(t[1]), at(t[2])) > 1e-6 * longest)
      kept.insert(kept.end(), t.begin(), t.end());
  }
  return Eigen::Map<Triangles>(kept.data(), static_cast<Eigen::Index>(kept.size() / 3), 3);
}

}  // namespace flash::data
