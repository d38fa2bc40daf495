#include "tests/sim/render/drawn_pictures.h"

#include <limits>

namespace flash::sim {

using Eigen::Isometry3d, Eigen::Vector3d;

data::TriangleMesh triangles_about(int count, std::mt19937_64& random) {
  std::uniform_real_distribution<double> place(-1, 1), extent(-0.4, 0.4);
  data::TriangleMesh mesh{data::Points(3 * count, 3), data::Triangles(count, 3)};
  for (int t = 0; t < count; ++t) {
    const Eigen::RowVector3d centre(place(random), place(random), place(random));
    for (int k = 0; k < 3; ++k)
      mesh.vertices.row(3 * t + k) =
          centre + Eigen::RowVector3d(extent(random), extent(random), extent(random));
    if (t % 5 == 0)  // a sliver
      mesh.vertices.row(3 * t + 2) =
          mesh.vertices.row(3 * t) + 1e-3 * Eigen::RowVector3d(place(random), place(random), place(random));
    mesh.triangles.row(t) << 3 * t, 3 * t + 1, 3 * t + 2;
  }
  return mesh;
}

namespace {

Isometry3d drawn_pose(std::mt19937_64& random, double far) {
  std::normal_distribution<double> normal;
  Isometry3d pose = Isometry3d::Identity();
  pose.linear() = Eigen::Quaterniond(normal(random), normal(random), normal(random), normal(random))
                      .normalized()
                      .matrix();
  pose.translation() = far * Vector3d(normal(random), normal(random), normal(random));
  return pose;
}

}  // namespace

DrawnPictures::DrawnPictures(std::mt19937_64& random) {
  constexpr std::size_t pictures = 3;
  lens.width = 64, lens.height = 48;
  lens.fx = 50, lens.fy = 52, lens.cx = 31.3, lens.cy = 23.8;
  for (std::size_t k = 0; k < pictures; ++k) base_from_camera.push_back(drawn_pose(random, 0.1));
  for (const int count : {12, 8, 20, 6}) surfaces.push_back(triangles_about(count, random));
  surfaces.push_back(surfaces[2]);  // that which yields, a millimetre beside what lies on it
  surfaces[4].vertices.array() += 1e-3;
  surfaces.push_back(surfaces[2]);  // another one at one depth with it, to single precision
  surfaces[5].vertices.array() += 1e-9;
  for (const data::TriangleMesh& surface : surfaces)
    meshes.push_back({.triangles = &surface.triangles,
                      .vertex_count = surface.vertices.rows(),
                      .vertices = {surface.vertices.data()}});
  meshes[0].vertices.clear();
  for (std::size_t k = 0; k < pictures; ++k) {
    moved.push_back(surfaces[0].vertices.array() + 0.01 * static_cast<double>(k));
    if (k == 1) moved.back()(4, 1) = std::numeric_limits<double>::quiet_NaN();
    meshes[0].vertices.push_back(moved.back().data());
    meshes[1].base_from_mesh.push_back(drawn_pose(random, 0.2));
  }
  meshes[3].triangles = nullptr;
  meshes[4].yields = 3e-3;
}

std::size_t DrawnPictures::pixels() const {
  return static_cast<std::size_t>(lens.width) * static_cast<std::size_t>(lens.height);
}

PictureMemory::PictureMemory(const DrawnPictures& drawn)
    : depth(drawn.base_from_camera.size() * drawn.pixels()),
      distance(depth.size()),
      points(3 * depth.size()),
      instance(depth.size()),
      triangle(depth.size()) {}

DepthPictures PictureMemory::pictures() {
  return {depth.data(), distance.data(), instance.data(), triangle.data(), points.data()};
}

}  // namespace flash::sim
