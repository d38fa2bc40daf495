#include "data/mesh/weld.h"

#include <array>
#include <map>
#include <vector>

namespace flash::data {
namespace {

/// In the order of the vertices as they were.
template <class Elements>
Points weld(const Points& vertices, Elements& elements) {
  std::vector<bool> used(static_cast<std::size_t>(vertices.rows()), false);
  for (const int vertex : elements.reshaped()) used[static_cast<std::size_t>(vertex)] = true;
  std::map<std::array<double, 3>, int> known;
  std::vector<int> kept, becomes(used.size(), -1);
  for (int v = 0; v < vertices.rows(); ++v) {
    if (!used[static_cast<std::size_t>(v)]) continue;
    const auto [found, is_new] = known.emplace(std::array{vertices(v, 0), vertices(v, 1), vertices(v, 2)},
                                               static_cast<int>(kept.size()));
    if (is_new) kept.push_back(v);
    becomes[static_cast<std::size_t>(v)] = found->second;
  }
  for (int& vertex : elements.reshaped()) vertex = becomes[static_cast<std::size_t>(vertex)];
  return vertices(kept, Eigen::all);
}

}  // namespace

std::size_t doubled_vertices(const Points& vertices) {
  std::map<std::array<double, 3>, int> known;
  std::size_t doubled = 0;
  for (const auto& place : vertices.rowwise())
    if (!known.emplace(std::array{place[0], place[1], place[2]}, 0).second) ++doubled;
  return doubled;
}

TriangleMesh welded(const TriangleMesh& mesh) {
  TriangleMesh result;
  result.triangles = mesh.triangles;
  result.vertices = weld(mesh.vertices, result.triangles);
  return result;
}

TetMesh welded(const TetMesh& mesh) {
  TetMesh result;
  result.tetrahedra = mesh.tetrahedra;
  result.vertices = weld(mesh.vertices, result.tetrahedra);
  return result;
}

}  // namespace flash::data
