#include "data/mesh/two_layers.h"

#include <array>
#include <map>
#include <vector>

namespace flash::data {

TriangleMesh two_layers(const TwoLayers& garment) {
  std::vector<Eigen::Vector3d> vertices;
  std::vector<Eigen::Vector3i> triangles;
  std::map<std::array<int, 2>, int> seams;
  for (const bool front : {false, true}) {
    std::map<std::array<int, 2>, int> layer;
    for (int j = 0; j <= garment.last_row; ++j)
      for (int i = garment.first_column; i <= garment.last_column; ++i) {
        if (!garment.has(i, j)) continue;
        const bool sewn = garment.is_sewn(i, j);
        if (sewn && front) continue;
        const double z = sewn ? 0.5 * garment.apart : front ? garment.apart : 0;
        (sewn ? seams : layer)[{i, j}] = static_cast<int>(vertices.size());
        const Eigen::Vector2d place = garment.place(i, j, front);
        vertices.emplace_back(place.x(), place.y(), z);
      }
    const auto vertex = [&](int i, int j) {
      const auto seam = seams.find({i, j});
      return seam != seams.end() ? seam->second : layer.at({i, j});
    };
    const auto add = [&](int a, int b, int c) {
      triangles.emplace_back(front ? Eigen::Vector3i(a, b, c) : Eigen::Vector3i(a, c, b));
    };
    for (int j = 0; j < garment.last_row; ++j)
      for (int i = garment.first_column; i < garment.last_column; ++i) {
        if (!garment.has(i, j) || !garment.has(i + 1, j) || !garment.has(i, j + 1) ||
            !garment.has(i + 1, j + 1))
          continue;
        const int a = vertex(i, j), b = vertex(i + 1, j), c = vertex(i, j + 1), d = vertex(i + 1, j + 1);
        if ((i + j) % 2 == 0) {
          add(a, b, d);
          add(a, d, c);
        } else {
          add(a, b, c);
          add(b, d, c);
        }
      }
  }

  TriangleMesh mesh;
  mesh.vertices.resize(static_cast<Eigen::Index>(vertices.size()), 3);
  for (std::size_t k = 0; k < vertices.size(); ++k)
    mesh.vertices.row(static_cast<Eigen::Index>(k)) = vertices[k].transpose();
  mesh.triangles.resize(static_cast<Eigen::Index>(triangles.size()), 3);
  for (std::size_t k = 0; k < triangles.size(); ++k)
    mesh.triangles.row(static_cast<Eigen::Index>(k)) = triangles[k].transpose();
  return mesh;
}

}  // namespace flash::data
