#include "data/mesh/seams.h"

#include <array>
#include <map>
#include <numeric>
#include <utility>
#include <vector>

#include "data/files/text.h"

namespace flash::data {
namespace {

/// Parts that hang together over vertices.
std::size_t parts_of(const TriangleMesh& mesh) {
  std::vector<int> above(static_cast<std::size_t>(mesh.vertices.rows()));
  std::iota(above.begin(), above.end(), 0);
  const auto root_of = [&](int vertex) {
    int root = vertex;
    while (above[static_cast<std::size_t>(root)] != root) root = above[static_cast<std::size_t>(root)];
    for (int i = vertex; i != root;) i = std::exchange(above[static_cast<std::size_t>(i)], root);
    return root;
  };
  std::size_t parts = above.size();
  for (const auto& t : mesh.triangles.rowwise())
    for (const int corner : {t[1], t[2]}) {
      const int a = root_of(t[0]), b = root_of(corner);
      above[static_cast<std::size_t>(a)] = b;
      parts -= a != b;
    }
  return parts;
}

}  // namespace

std::string seam_warning(const TriangleMesh& mesh) {
  std::map<std::array<double, 3>, std::size_t> at;
  for (const auto& place : mesh.vertices.rowwise()) ++at[{place[0], place[1], place[2]}];
  std::size_t shared = 0;
  for (const auto& [place, vertices] : at)
    if (vertices > 1) shared += vertices;
  if (shared == 0) return "";
  const std::size_t parts = parts_of(mesh);
  return format_count(shared) + " of its " + format_count(static_cast<std::size_t>(mesh.vertices.rows())) +
         " vertices share a place with another and are not joined: the mesh " +
         (parts > 1 ? "falls into " + format_count(parts) + " parts" : "is slit there") +
         "; flash-sim mesh --weld joins them";
}

}  // namespace flash::data
