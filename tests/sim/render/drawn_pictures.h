#pragma once
#include <Eigen/Geometry>
#include <cstdint>
#include <deque>
#include <random>
#include <vector>

#include "data/mesh/mesh.h"
#include "sim/render/depth_camera.h"

namespace flash::sim {

/// Triangles about the origin, with sides up to 0.8 m: also slivers.
data::TriangleMesh triangles_about(int count, std::mt19937_64& random);

/// Cameras among meshes, drawn by lot: one that moves from picture to picture, one that stands in a pose of
/// each picture, one that yields and lies just over another, and one that is not seen.
struct DrawnPictures {
  data::CameraIntrinsics lens;
  std::vector<Eigen::Isometry3d> base_from_camera;
  std::vector<data::TriangleMesh> surfaces;
  std::deque<data::Points> moved;
  std::vector<SeenMesh> meshes;

  explicit DrawnPictures(std::mt19937_64& random);
  std::size_t pixels() const;  ///< of a picture
};

/// Room for all that pictures may hold.
struct PictureMemory {
  std::vector<float> depth, distance, points;
  std::vector<std::uint8_t> instance;
  std::vector<std::int32_t> triangle;

  explicit PictureMemory(const DrawnPictures& drawn);
  DepthPictures pictures();
  bool operator==(const PictureMemory&) const = default;
};

}  // namespace flash::sim
