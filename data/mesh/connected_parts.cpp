#include "data/mesh/connected_parts.h"

#include <algorithm>
#include <map>
#include <numeric>

namespace flash::data {

std::vector<int> first_of_part(const TriangleMesh& mesh) {
  std::vector<int> first(static_cast<std::size_t>(mesh.vertices.rows()));
  std::iota(first.begin(), first.end(), 0);
  const auto root = [&](int vertex) {
    while (first[static_cast<std::size_t>(vertex)] != vertex) {
      int& above = first[static_cast<std::size_t>(vertex)];
      vertex = above = first[static_cast<std::size_t>(above)];
    }
    return vertex;
  };
  for (const auto triangle : mesh.triangles.rowwise())
    for (const int k : {1, 2}) {
      const int a = root(triangle[0]), b = root(triangle[k]);
      first[static_cast<std::size_t>(std::max(a, b))] = std::min(a, b);
    }
  for (int v = 0; v < mesh.vertices.rows(); ++v) first[static_cast<std::size_t>(v)] = root(v);
  return first;
}

std::vector<TriangleMesh> connected_parts(const TriangleMesh& mesh) {
  const std::vector<int> first = first_of_part(mesh);
  std::map<int, std::vector<Eigen::Index>> triangles;
  for (Eigen::Index t = 0; t < mesh.triangles.rows(); ++t)
    triangles[first[static_cast<std::size_t>(mesh.triangles(t, 0))]].push_back(t);
  std::vector<TriangleMesh> parts;
  std::vector<int> place(first.size());
  for (const auto& [root, members] : triangles) {
    TriangleMesh& part = parts.emplace_back();
    std::vector<int> vertices;
    for (std::size_t v = 0; v < first.size(); ++v)
      if (first[v] == root) {
        place[v] = static_cast<int>(vertices.size());
        vertices.push_back(static_cast<int>(v));
      }
    part.vertices = mesh.vertices(vertices, Eigen::all);
    part.triangles = mesh.triangles(members, Eigen::all).unaryExpr([&](int v) {
      return place[static_cast<std::size_t>(v)];
    });
  }
  return parts;
}

}  // namespace flash::data
