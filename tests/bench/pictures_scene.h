#pragma once
#include <benchmark/benchmark.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "data/mesh/procedural_mesh.h"
#include "data/mesh/tshirt.h"
#include "sim/render/depth_camera.h"

namespace flash::sim::bench {

/// Some 13,000 triangles, as many as the published figures are of.
inline data::TriangleMesh garment() {
  data::TshirtMesh shirt;
  shirt.cell = 0.0106;
  return data::tshirt(shirt);
}

/// 1,024 vertices.
inline data::TriangleMesh towel() { return data::rectangle({.cells_x = 31, .cells_y = 31}); }

inline constexpr int picture_width = 320, picture_height = 240;

/// The cloth of many environments, waved, each in its own way, and a camera over each.
struct PicturesScene {
  data::CameraIntrinsics lens;
  data::Triangles triangles;
  std::vector<data::Points> vertices;
  data::TriangleMesh table;
  std::vector<Eigen::Isometry3d> cameras;
  std::vector<SeenMesh> meshes;

  PicturesScene(const data::TriangleMesh& cloth, int environments, bool on_table)
      : triangles(cloth.triangles) {
    lens.width = picture_width, lens.height = picture_height;
    lens.fx = lens.fy = 300, lens.cx = 0.5 * (picture_width - 1), lens.cy = 0.5 * (picture_height - 1);
    const Eigen::RowVector3d middle =
        0.5 * (cloth.vertices.colwise().minCoeff() + cloth.vertices.colwise().maxCoeff());
    for (int e = 0; e < environments; ++e) {
      data::Points waved = cloth.vertices.rowwise() - middle;
      for (auto vertex : waved.rowwise())
        vertex.z() += 0.02 * std::sin(15 * vertex.x() + e) * std::cos(11 * vertex.y() - 2 * e);
      vertices.push_back(std::move(waved));
      // Straight down, turned a little, from where the cloth fills the height of the picture.
      Eigen::Isometry3d camera(Eigen::AngleAxisd(std::numbers::pi, Eigen::Vector3d::UnitX()) *
                               Eigen::AngleAxisd(0.1 + 0.01 * e, Eigen::Vector3d::UnitZ()));
      const double extent = vertices.back().col(1).maxCoeff() - vertices.back().col(1).minCoeff();
      camera.translation() = Eigen::Vector3d(0, 0, 1.2 * extent * lens.fy / picture_height);
      cameras.push_back(camera);
    }
    SeenMesh seen{.triangles = &triangles, .vertex_count = cloth.vertices.rows()};
    for (const data::Points& each : vertices) seen.vertices.push_back(each.data());
    meshes.push_back(std::move(seen));
    if (!on_table) return;
    table = {data::Points(4, 3), data::Triangles(2, 3)};
    table.vertices << -9, -9, -0.03, 9, -9, -0.03, 9, 9, -0.03, -9, 9, -0.03;
    table.triangles << 0, 1, 2, 0, 2, 3;
    meshes.push_back({&table.triangles, 4, {table.vertices.data()}});
  }
};

/// The time of each picture where so many are drawn at a time.
inline benchmark::Counter time_of_a_picture(std::size_t pictures) {
  return {static_cast<double>(pictures),
          benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert};
}

}  // namespace flash::sim::bench
