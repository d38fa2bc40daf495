// The text by which kernels draw depth pictures, taken by one thread of the processor, beside its own
// pictures.
#include "sim/cuda/depth_drawing.cuh"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <random>
#include <vector>

#include "sim/law/rigid_frame.h"
#include "tests/sim/render/drawn_pictures.h"

namespace flash::sim::cuda {
namespace {

/// Draws as kernels do, triangles in an order drawn by lot, as threads come in any.
void draw_by_text(const DrawnPictures& drawn, const DepthPictures& to, std::mt19937_64& random) {
  const std::size_t pictures = drawn.base_from_camera.size(), meshes = drawn.meshes.size();
  std::vector<DrawnMesh> tables;
  std::vector<LargeTriangle> triangles, large;
  std::uint32_t first = 0;
  int vertices = 0;
  for (std::size_t m = 0; m < meshes; ++m) {
    const data::Triangles& corners = drawn.surfaces[m].triangles;
    tables.push_back({.corners = corners.data(),
                      .triangles = static_cast<int>(corners.rows()),
                      .vertices = static_cast<int>(drawn.meshes[m].vertex_count),
                      .first_vertex = vertices,
                      .first = first,
                      .yields = drawn.meshes[m].yields});
    vertices += tables.back().vertices;
    first += static_cast<std::uint32_t>(corners.rows());
    for (std::size_t k = 0; k < pictures; ++k)
      for (int t = 0; t < corners.rows(); ++t)
        triangles.push_back({static_cast<int>(k), static_cast<int>(m), t});
  }
  std::vector<PlacedMesh> placed;
  std::vector<Frame<double>> frames;
  for (std::size_t k = 0; k < pictures; ++k) {
    frames.push_back(frame_of(drawn.base_from_camera[k]));
    for (const SeenMesh& mesh : drawn.meshes)
      placed.push_back({mesh.triangles ? mesh.vertices[mesh.vertices.size() == 1 ? 0 : k] : nullptr,
                        camera_from_mesh(mesh, k, drawn.base_from_camera[k].inverse())});
  }
  const std::size_t pixels = pictures * drawn.pixels();
  std::vector<std::uint64_t> yielding(pixels), solid(pixels);
  std::vector<SeenVertex> seen(pictures * static_cast<std::size_t>(vertices));
  const PictureBatch batch{.camera = pinhole_of(drawn.lens),
                           .pictures = static_cast<int>(pictures),
                           .meshes = static_cast<int>(meshes),
                           .vertices = vertices,
                           .drawn = tables.data(),
                           .placed = placed.data(),
                           .camera_frames = frames.data(),
                           .yielding = yielding.data(),
                           .solid = solid.data(),
                           .seen = seen.data(),
                           .to = to};
  for (int k = 0; k < batch.pictures; ++k)
    for (int m = 0; m < batch.meshes; ++m)
      for (int v = 0; v < tables[static_cast<std::size_t>(m)].vertices; ++v) place_vertex(batch, k, m, v);
  const auto raise = [](std::uint64_t& key, std::uint64_t other) { key = std::max(key, other); };
  std::shuffle(triangles.begin(), triangles.end(), random);
  for (const LargeTriangle& triangle : triangles)
    draw_triangle(batch, triangle, raise, [&](const LargeTriangle& left) { large.push_back(left); });
  EXPECT_GT(large.size(), 0u);
  EXPECT_LT(large.size(), triangles.size());
  constexpr int bands = 3, threads = 5;
  for (const LargeTriangle& triangle : large)
    for (int band = 0; band < bands; ++band)
      for (int thread = 0; thread < threads; ++thread)
        draw_tiles(batch, triangle, band, bands, thread, threads, raise);
  for (std::size_t k = 0; k < pictures; ++k)
    for (int pixel = 0; pixel < batch.pixels(); ++pixel) finish_pixel(batch, static_cast<int>(k), pixel);
}

TEST(DepthDrawing, IsThatOfTheProcessorBitForBit) {
  std::mt19937_64 random(11);
  for (int scene = 0; scene < 40; ++scene) {
    SCOPED_TRACE(scene);
    const DrawnPictures drawn(random);
    PictureMemory own(drawn), text(drawn);
    render(drawn.lens, drawn.base_from_camera, drawn.meshes, own.pictures(), 1);
    draw_by_text(drawn, text.pictures(), random);
    EXPECT_EQ(own, text);
  }
}

// Of one depth the first of all triangles shows, whatever comes first.
TEST(DepthDrawing, KeysRiseWithInverseDepthAndFallWithTheTriangle) {
  EXPECT_GT(nearest_key(1, 5), nearest_key(0.999999, 0));
  EXPECT_GT(nearest_key(1, 4), nearest_key(1, 5));
  EXPECT_GT(nearest_key(1e-30, 0xfffffffeu), no_key);
  EXPECT_EQ(triangle_of(nearest_key(0.3, 123456789u)), 123456789u);
}

}  // namespace
}  // namespace flash::sim::cuda
