#include "data/mesh/halved_tets.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <map>

namespace flash::data {

HalvedTets halved(const TetMesh& mesh) {
  HalvedTets finer;
  const auto count = static_cast<int>(mesh.vertices.rows());
  std::map<std::array<int, 2>, int> middles;
  const auto middle = [&](int a, int b) {
    const std::array<int, 2> edge = {std::min(a, b), std::max(a, b)};
    const auto [found, is_new] = middles.emplace(edge, count + static_cast<int>(finer.edges.size()));
    if (is_new) finer.edges.push_back(edge);
    return found->second;
  };
  const auto place = [&](int vertex) -> Eigen::RowVector3d {
    if (vertex < count) return mesh.vertices.row(vertex);
    const auto [a, b] = finer.edges[static_cast<std::size_t>(vertex - count)];
    return 0.5 * (mesh.vertices.row(a) + mesh.vertices.row(b));
  };
  std::vector<std::array<int, 4>> tets;
  for (Eigen::Index t = 0; t < mesh.tetrahedra.rows(); ++t) {
    const Eigen::Vector4i v = mesh.tetrahedra.row(t);
    // Opposite edges of a tetrahedron: their middles are the ends of a diagonal.
    const std::array<std::array<int, 2>, 3> diagonals = {{{middle(v[0], v[1]), middle(v[2], v[3])},
                                                          {middle(v[0], v[2]), middle(v[1], v[3])},
                                                          {middle(v[0], v[3]), middle(v[1], v[2])}}};
    for (int k = 0; k < 4; ++k) {
      std::array<int, 4> corner{};
      for (int j = 0; j < 4; ++j) corner[static_cast<std::size_t>(j)] = j == k ? v[k] : middle(v[k], v[j]);
      tets.push_back(corner);
    }
    const auto length = [&](const std::array<int, 2>& ends) {
      return (place(ends[0]) - place(ends[1])).norm();
    };
    const auto shortest = static_cast<std::size_t>(
        std::min_element(diagonals.begin(), diagonals.end(),
                         [&](const auto& a, const auto& b) { return length(a) < length(b); }) -
        diagonals.begin());
    const auto [from, to] = diagonals[shortest];
    const auto& p = diagonals[(shortest + 1) % 3];
    const auto& q = diagonals[(shortest + 2) % 3];
    // Around it the ends of the two others take turns.
    const std::array<int, 4> ring = {p[0], q[0], p[1], q[1]};
    for (std::size_t k = 0; k < 4; ++k) {
      std::array<int, 4> inner = {from, to, ring[k], ring[(k + 1) % 4]};
      const Eigen::Vector3d a = (place(inner[1]) - place(inner[0])).transpose(),
                            b = (place(inner[2]) - place(inner[0])).transpose(),
                            c = (place(inner[3]) - place(inner[0])).transpose();
      if (a.dot(b.cross(c)) < 0) std::swap(inner[2], inner[3]);
      tets.push_back(inner);
    }
  }
  finer.mesh.vertices.resize(count + static_cast<Eigen::Index>(finer.edges.size()), 3);
  for (int i = 0; i < finer.mesh.vertices.rows(); ++i) finer.mesh.vertices.row(i) = place(i);
  finer.mesh.tetrahedra.resize(static_cast<Eigen::Index>(tets.size()), 4);
  for (std::size_t t = 0; t < tets.size(); ++t)
    for (int k = 0; k < 4; ++k)
      finer.mesh.tetrahedra(static_cast<Eigen::Index>(t), k) = tets[t][static_cast<std::size_t>(k)];
  return finer;
}

}  // namespace flash::data
