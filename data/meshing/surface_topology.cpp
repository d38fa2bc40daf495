#include "data/meshing/surface_topology.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <limits>
#include <map>
#include <numeric>
#include <utility>

#include "data/files/error.h"
#include "data/files/text.h"

namespace flash::data {
namespace {

using Side = std::array<int, 2>;

/// The triangle of each directed side.
std::map<Side, int> sides_of(const Triangles& triangles) {
  std::map<Side, int> sides;
  for (int i = 0; i < triangles.rows(); ++i)
    for (int k = 0; k < 3; ++k) sides.emplace(Side{triangles(i, k), triangles(i, (k + 1) % 3)}, i);
  return sides;
}

/// Sets of numbers that grow together.
class Unions {
 public:
  explicit Unions(int size) : parents_(std::size_t(size)) { std::iota(parents_.begin(), parents_.end(), 0); }
  int root(int i) {
    while (parents_[std::size_t(i)] != i)
      i = parents_[std::size_t(i)] = parents_[std::size_t(parents_[std::size_t(i)])];
    return i;
  }
  void join(int i, int k) { parents_[std::size_t(std::max(root(i), root(k)))] = std::min(root(i), root(k)); }

 private:
  std::vector<int> parents_;
};

/// The component of each triangle, as one of its triangles.
std::vector<int> components_of(const Triangles& triangles) {
  Unions unions(int(triangles.rows()));
  const std::map<Side, int> sides = sides_of(triangles);
  for (const auto& [side, triangle] : sides)
    if (const auto other = sides.find({side[1], side[0]}); other != sides.end())
      unions.join(triangle, other->second);
  std::vector<int> roots(std::size_t(triangles.rows()));
  for (int i = 0; i < triangles.rows(); ++i) roots[std::size_t(i)] = unions.root(i);
  return roots;
}

double area_of(const Points& x, const Eigen::Vector3i& t) {
  const Eigen::Vector3d a = x.row(t[1]) - x.row(t[0]), b = x.row(t[2]) - x.row(t[0]);
  return a.cross(b).norm() / 2;
}

Triangles rows_of(const std::vector<Eigen::Vector3i>& list) {
  Triangles triangles(Eigen::Index(list.size()), 3);
  for (std::size_t i = 0; i < list.size(); ++i) triangles.row(Eigen::Index(i)) = list[i];
  return triangles;
}

TriangleMesh without_lone_vertices(const TriangleMesh& mesh) {
  std::vector<int> place(std::size_t(mesh.vertices.rows()), -1), kept;
  for (const int vertex : mesh.triangles.reshaped<Eigen::RowMajor>()) place[std::size_t(vertex)] = 0;
  for (int i = 0; i < mesh.vertices.rows(); ++i)
    if (place[std::size_t(i)] == 0) {
      place[std::size_t(i)] = int(kept.size());
      kept.push_back(i);
    }
  TriangleMesh result{mesh.vertices(kept, Eigen::all), mesh.triangles};
  for (int& vertex : result.triangles.reshaped()) vertex = place[std::size_t(vertex)];
  return result;
}

TriangleMesh welded(const TriangleMesh& mesh) {
  std::map<std::array<double, 3>, int> known;
  std::vector<int> first(std::size_t(mesh.vertices.rows()));
  for (int i = 0; i < mesh.vertices.rows(); ++i)
    first[std::size_t(i)] =
        known.emplace(std::array{mesh.vertices(i, 0), mesh.vertices(i, 1), mesh.vertices(i, 2)}, i)
            .first->second;
  std::vector<Eigen::Vector3i> kept;
  for (const auto& row : mesh.triangles.rowwise()) {
    const Eigen::Vector3i t(first[std::size_t(row[0])], first[std::size_t(row[1])],
                            first[std::size_t(row[2])]);
    if (t[0] != t[1] && t[1] != t[2] && t[2] != t[0]) kept.push_back(t);
  }
  return without_lone_vertices({mesh.vertices, rows_of(kept)});
}

/// One vertex for each fan of triangles about it.
TriangleMesh with_fans_apart(const TriangleMesh& mesh) {
  // Corner 3 i + k is vertex k of triangle i; corners of one vertex in triangles with a common side join.
  Unions corners(int(3 * mesh.triangles.rows()));
  const std::map<Side, int> sides = sides_of(mesh.triangles);
  const auto corner_of = [&](int triangle, int vertex) {
    for (int k = 0; k < 3; ++k)
      if (mesh.triangles(triangle, k) == vertex) return 3 * triangle + k;
    return -1;
  };
  for (const auto& [side, triangle] : sides)
    if (const auto other = sides.find({side[1], side[0]}); other != sides.end())
      for (const int vertex : side)
        corners.join(corner_of(triangle, vertex), corner_of(other->second, vertex));
  TriangleMesh result = mesh;
  std::vector<int> owner(std::size_t(mesh.vertices.rows()), -1);  // the fan that keeps the vertex
  std::map<int, int> added;                                       // the vertex of each further fan
  std::vector<int> origin;                                        // the vertex that it was
  for (int i = 0; i < mesh.triangles.rows(); ++i)
    for (int k = 0; k < 3; ++k) {
      const int vertex = mesh.triangles(i, k), fan = corners.root(3 * i + k);
      int& own = owner[std::size_t(vertex)];
      if (own < 0) own = fan;
      if (own == fan) continue;
      const auto [place, is_new] = added.emplace(fan, int(mesh.vertices.rows()) + int(origin.size()));
      if (is_new) origin.push_back(vertex);
      result.triangles(i, k) = place->second;
    }
  result.vertices.conservativeResize(mesh.vertices.rows() + Eigen::Index(origin.size()), 3);
  for (std::size_t i = 0; i < origin.size(); ++i)
    result.vertices.row(mesh.vertices.rows() + Eigen::Index(i)) = mesh.vertices.row(origin[i]);
  return result;
}

/// Triangles of the least area over the loop, which they run along, without an edge that there is already.
/// Empty where there are none.
std::vector<Eigen::Vector3i> least_area(const Points& x, const std::vector<int>& loop,
                                        const std::map<Side, int>& sides) {
  const int n = int(loop.size());
  const auto at = [&](int i) { return loop[std::size_t(i)]; };
  Eigen::MatrixXd cost = Eigen::MatrixXd::Zero(n, n);
  Eigen::MatrixXi middle = Eigen::MatrixXi::Constant(n, n, -1);
  for (int width = 2; width < n; ++width)
    for (int i = 0; i + width < n; ++i) {
      const int k = i + width;
      cost(i, k) = std::numeric_limits<double>::infinity();
      const bool taken = sides.contains({at(i), at(k)}) || sides.contains({at(k), at(i)});
      if (taken && width < n - 1) continue;
      for (int m = i + 1; m < k; ++m) {
        const double sum = cost(i, m) + cost(m, k) + area_of(x, {at(i), at(m), at(k)});
        if (sum < cost(i, k)) {
          cost(i, k) = sum;
          middle(i, k) = m;
        }
      }
    }
  std::vector<Eigen::Vector3i> triangles;
  std::vector<Side> spans = {{0, n - 1}};
  while (!spans.empty()) {
    const auto [i, k] = spans.back();
    spans.pop_back();
    const int m = middle(i, k);
    if (m < 0) {
      if (k - i > 1) return {};
      continue;
    }
    triangles.emplace_back(at(i), at(m), at(k));
    spans.push_back({i, m});
    spans.push_back({m, k});
  }
  return triangles;
}

double length_of(const Points& x, const std::vector<int>& loop) {
  double length = 0;
  for (std::size_t i = 0; i < loop.size(); ++i)
    length += (x.row(loop[(i + 1) % loop.size()]) - x.row(loop[i])).norm();
  return length;
}

}  // namespace

double area_of(const TriangleMesh& mesh) {
  double area = 0;
  for (const auto& t : mesh.triangles.rowwise()) area += area_of(mesh.vertices, t);
  return area;
}

SurfaceTopology topology_of(const TriangleMesh& mesh) {
  SurfaceTopology result;
  const std::map<Side, int> sides = sides_of(mesh.triangles);
  std::map<int, int> next;  // along the borders
  int edges = 0;
  for (const auto& [side, triangle] : sides) {
    const bool border = !sides.contains({side[1], side[0]});
    if (border) next[side[0]] = side[1];
    if (border || side[0] < side[1]) ++edges;
  }
  std::vector<int> roots = components_of(mesh.triangles);
  std::sort(roots.begin(), roots.end());
  result.components = int(std::unique(roots.begin(), roots.end()) - roots.begin());
  std::vector<bool> used(std::size_t(mesh.vertices.rows()), false);
  for (const int vertex : mesh.triangles.reshaped()) used[std::size_t(vertex)] = true;
  result.euler = int(std::count(used.begin(), used.end(), true)) - edges + int(mesh.triangles.rows());
  while (!next.empty()) {
    std::vector<int> loop;
    int vertex = next.begin()->first;
    for (auto at = next.begin(); at != next.end(); at = next.find(vertex)) {
      loop.push_back(vertex);
      vertex = at->second;
      next.erase(at);
    }
    result.borders.push_back(std::move(loop));
  }
  std::stable_sort(result.borders.begin(), result.borders.end(), [&](const auto& a, const auto& b) {
    return length_of(mesh.vertices, a) > length_of(mesh.vertices, b);
  });
  return result;
}

TriangleMesh checked_surface(const TriangleMesh& mesh, const std::string& source) {
  TriangleMesh result = welded(mesh);
  if (result.triangles.rows() == 0) throw InputError(source + ": found no triangles with an area");
  std::map<Side, int> sides;
  for (int i = 0; i < result.triangles.rows(); ++i)
    for (int k = 0; k < 3; ++k) {
      const Side side = {result.triangles(i, k), result.triangles(i, (k + 1) % 3)};
      if (sides.emplace(side, i).second) continue;
      const Eigen::RowVector3d place = (result.vertices.row(side[0]) + result.vertices.row(side[1])) / 2;
      throw input_error(source,
                        "edge at (" + format_short(place[0]) + ", " + format_short(place[1]) + ", " +
                            format_short(place[2]) + ")",
                        "is no part of one surface: more than two triangles meet there, or two that run "
                        "against each other; --points takes the vertices alone, as a cloud");
    }
  return with_fans_apart(result);
}

TriangleMesh largest_component(const TriangleMesh& mesh, double& dropped) {
  const std::vector<int> roots = components_of(mesh.triangles);
  std::map<int, double> areas;
  for (std::size_t i = 0; i < roots.size(); ++i)
    areas[roots[i]] += area_of(mesh.vertices, mesh.triangles.row(Eigen::Index(i)));
  const auto largest = std::max_element(areas.begin(), areas.end(),
                                        [](const auto& a, const auto& b) { return a.second < b.second; });
  std::vector<Eigen::Vector3i> kept;
  for (std::size_t i = 0; i < roots.size(); ++i)
    if (roots[i] == largest->first) kept.push_back(mesh.triangles.row(Eigen::Index(i)));
  dropped = areas.size() == 1 ? 0 : 1 - largest->second / area_of(mesh);
  return without_lone_vertices({mesh.vertices, rows_of(kept)});
}

FilledSurface fill_holes(const TriangleMesh& mesh, double diameter) {
  constexpr std::size_t most_edges = 400;  // the work grows with its cube
  FilledSurface result{mesh};
  const SurfaceTopology topology = topology_of(mesh);
  const std::map<Side, int> sides = sides_of(mesh.triangles);
  std::vector<Eigen::Vector3i> patches;
  for (std::size_t i = 1; i < topology.borders.size(); ++i) {
    std::vector<int> loop = topology.borders[i];
    if (loop.size() > most_edges || length_of(mesh.vertices, loop) > EIGEN_PI * diameter) continue;
    std::reverse(loop.begin(), loop.end());  // patches run against the triangles beside the hole
    const std::vector<Eigen::Vector3i> patch = least_area(mesh.vertices, loop, sides);
    if (patch.empty()) continue;
    patches.insert(patches.end(), patch.begin(), patch.end());
    ++result.filled;
  }
  const Eigen::Index rows = mesh.triangles.rows();
  result.mesh.triangles.conservativeResize(rows + Eigen::Index(patches.size()), 3);
  result.mesh.triangles.bottomRows(Eigen::Index(patches.size())) = rows_of(patches);
  return result;
}

}  // namespace flash::data
