#include "sim/scene/slopes.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

namespace flash::sim {
namespace {

std::vector<bool> marked(const std::vector<int>& vertices, const Sheet& sheet) {
  std::vector<bool> marks(static_cast<std::size_t>(sheet.rest.vertices.rows()), false);
  for (const int vertex : vertices) marks[static_cast<std::size_t>(vertex)] = true;
  return marks;
}

bool is_held(const RestTriangle& triangle, const std::vector<bool>& held) {
  return std::all_of(triangle.vertices.begin(), triangle.vertices.end(),
                     [&](int vertex) { return held[static_cast<std::size_t>(vertex)]; });
}

/// Calls visit(s, t) for each two triangles over a common edge, once.
template <class Visit>
void for_each_neighbours(const Sheet& sheet, const Visit& visit) {
  std::map<std::pair<int, int>, int> sides;
  for (int t = 0; t < std::ssize(sheet.triangles); ++t) {
    const Eigen::Vector3i& v = sheet.triangles[static_cast<std::size_t>(t)].vertices;
    for (int k = 0; k < 3; ++k) {
      const auto [other, is_first] = sides.emplace(std::minmax(v[k], v[(k + 1) % 3]), t);
      if (!is_first) visit(other->second, t);
    }
  }
}

}  // namespace

int keep_slopes(const std::vector<int>& held, Sheet& sheet) {
  const std::vector<bool> inside = marked(held, sheet);
  int count = 0;
  for (RestTriangle& triangle : sheet.triangles)
    if (is_held(triangle, inside)) {
      triangle.stiff = true;
      ++count;
    }
  return count;
}

bool slope_gives_way(const Sheet& sheet, const std::vector<int>& held) {
  const std::vector<bool> inside = marked(held, sheet);
  bool gives_way = false;
  for_each_neighbours(sheet, [&](int s, int t) {
    const RestTriangle &first = sheet.triangles[static_cast<std::size_t>(s)],
                       &second = sheet.triangles[static_cast<std::size_t>(t)];
    const bool in = is_held(first, inside);
    if (in != is_held(second, inside)) gives_way = gives_way || !(in ? first : second).stiff;
  });
  return gives_way;
}

double bend_between_stiff(const Sheet& sheet, const data::Points& places) {
  const auto normal = [&](const RestTriangle& triangle) {
    const Eigen::Vector3i& v = triangle.vertices;
    const Eigen::Vector3d a = places.row(v[1]) - places.row(v[0]), b = places.row(v[2]) - places.row(v[0]);
    return Eigen::Vector3d(a.cross(b));
  };
  double most = 0;
  for_each_neighbours(sheet, [&](int s, int t) {
    const RestTriangle &first = sheet.triangles[static_cast<std::size_t>(s)],
                       &second = sheet.triangles[static_cast<std::size_t>(t)];
    if (!first.stiff || !second.stiff) return;
    const Eigen::Vector3d m = normal(first), n = normal(second);
    most = std::max(most, std::atan2(m.cross(n).norm(), m.dot(n)));
  });
  return most;
}

}  // namespace flash::sim
