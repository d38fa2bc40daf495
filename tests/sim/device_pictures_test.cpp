#include "sim/device_pictures.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <random>
#include <span>
#include <vector>

#include "data/files/error.h"
#include "sim/device_copies.h"
#include "tests/sim/render/drawn_pictures.h"

namespace flash::sim {
namespace {

/// The meshes of pictures with what moves on the device, and what draws them there.
struct There {
  DeviceCopies copies{0};
  std::vector<SeenMesh> meshes;
  DevicePictures device;

  explicit There(const DrawnPictures& drawn) : meshes(drawn.meshes), device(0, still(drawn)) {
    for (const double*& vertices : meshes[0].vertices)
      vertices = copies.of(std::span(vertices, static_cast<std::size_t>(3 * meshes[0].vertex_count)));
  }

  static std::vector<SeenMesh> still(const DrawnPictures& drawn) {
    std::vector<SeenMesh> meshes = drawn.meshes;
    meshes[0].vertices.clear();
    for (std::size_t m = 0; m < meshes.size(); ++m) meshes[m].triangles = &drawn.surfaces[m].triangles;
    return meshes;
  }
};

TEST(DevicePictures, AreThoseOfTheProcessorBitForBit) {
  if (!why_no_cuda().empty()) GTEST_SKIP() << why_no_cuda();
  std::mt19937_64 random(12);
  for (int scene = 0; scene < 30; ++scene) {
    SCOPED_TRACE(scene);
    const DrawnPictures drawn(random);
    There there(drawn);
    PictureMemory own(drawn), device(drawn);
    render(drawn.lens, drawn.base_from_camera, drawn.meshes, own.pictures(), 1);
    there.device.render(drawn.lens, drawn.base_from_camera, there.meshes, device.pictures(), Device::cpu);
    EXPECT_EQ(own, device);
  }
}

// More pictures than are drawn together, and those alone that are wanted.
TEST(DevicePictures, OfManyEnvironmentsAreThoseOfOneEach) {
  if (!why_no_cuda().empty()) GTEST_SKIP() << why_no_cuda();
  std::mt19937_64 random(13);
  const DrawnPictures drawn(random);
  There there(drawn);
  constexpr std::size_t repeats = 1000;
  std::vector<Eigen::Isometry3d> cameras;
  std::vector<SeenMesh> many = there.meshes;
  many[0].vertices.clear();
  many[1].base_from_mesh.clear();
  for (std::size_t k = 0; k < repeats * drawn.base_from_camera.size(); ++k) {
    const std::size_t own = k % drawn.base_from_camera.size();
    cameras.push_back(drawn.base_from_camera[own]);
    many[0].vertices.push_back(there.meshes[0].vertices[own]);
    many[1].base_from_mesh.push_back(there.meshes[1].base_from_mesh[own]);
  }
  PictureMemory once(drawn);
  there.device.render(drawn.lens, drawn.base_from_camera, there.meshes, once.pictures(), Device::cpu);
  std::vector<float> depth(repeats * once.depth.size());
  there.device.render(drawn.lens, cameras, many, {.depth = depth.data()}, Device::cpu);
  for (std::size_t k = 0; k < depth.size(); ++k) ASSERT_EQ(depth[k], once.depth[k % once.depth.size()]) << k;
}

TEST(DevicePictures, AreRefusedWhereThereIsNoDevice) {
  if (why_no_cuda().empty()) GTEST_SKIP() << "there is a CUDA device";
  EXPECT_ANY_THROW(DevicePictures(0, {}));
}

}  // namespace
}  // namespace flash::sim
