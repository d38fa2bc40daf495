// Depth cameras over many environments on one thread: a picture of 320 x 240 pixels of each, depth and
// instance. Counted of one picture: `vertices` and `triangles` of what is seen, `tried` pixels (centres in
// the bounding box of a triangle), `covered` ones (centres in a triangle) and `seen` ones. `a_picture` is its
// time [s] and `least` the least it takes, by the bytes that come and go through memory and the flops that
// its counts need, whatever the order (below).
#include <benchmark/benchmark.h>

#include <algorithm>
#include <vector>

#include "sim/render/depth_camera.h"
#include "tests/bench/pictures_scene.h"

namespace flash::sim {
namespace {

using bench::picture_width, bench::picture_height;
using Eigen::Isometry3d, Eigen::Vector3d, bench::PicturesScene;

// What one thread of a server's processor reaches at best: fused operations in double precision, four at
// once, twice a cycle at 2.5 GHz, and the memory of one of its cores.
constexpr double flops_a_second = 40e9, bytes_a_second = 10e9;

struct Counts {
  double vertices = 0, triangles = 0, tried = 0, covered = 0, seen = 0;

  explicit Counts(const PicturesScene& scene) {
    const Pinhole camera{picture_width, picture_height, scene.lens.fx,
                         scene.lens.fy, scene.lens.cx,  scene.lens.cy};
    const Isometry3d camera_from_base = scene.cameras[0].inverse();
    for (const SeenMesh& mesh : scene.meshes) {
      vertices += static_cast<double>(mesh.vertex_count);
      triangles += static_cast<double>(mesh.triangles->rows());
      for (const auto& corners : mesh.triangles->rowwise()) {
        ImageCorner at[3];
        for (int k = 0; k < 3; ++k) {
          const Vector3d x =
              camera_from_base * Vector3d(Eigen::Map<const Vector3d>(mesh.vertices[0] + 3 * corners[k]));
          at[k] = image_corner(camera, {x.x(), x.y(), x.z()});
        }
        const auto centres = [](double a, double b, double c, int size) {
          return std::max(0, last_pixel(std::max({a, b, c}), size) - first_pixel(least(a, b, c), size) + 1);
        };
        tried += static_cast<double>(centres(at[0].u, at[1].u, at[2].u, picture_width)) *
                 centres(at[0].v, at[1].v, at[2].v, picture_height);
        cover(whole_picture(camera), at[0], at[1], at[2], [&](int, int, double) { ++covered; });
      }
    }
    for (const PixelHit& hit : see(scene.lens, scene.cameras[0], scene.meshes)) seen += hit.mesh >= 0;
  }

  /// Vertices and triangles come once, depth and instance go once.
  double bytes() const { return 24 * vertices + 12 * triangles + 5.0 * picture_width * picture_height; }

  /// A vertex turns (18) and goes to the image (6); a triangle has an area, three edges and a plane of depth
  /// (40); a covered pixel three numbers of edges (6), a depth (4) and a comparison; a seen one its depth
  /// (1). Pixels that are tried in vain are no need.
  double flops() const { return 24 * vertices + 40 * triangles + 11 * covered + seen; }

  double least_seconds() const { return std::max(bytes() / bytes_a_second, flops() / flops_a_second); }
};

void draw_all(benchmark::State& state, const data::TriangleMesh& cloth) {
  const auto environments = static_cast<std::size_t>(state.range(0));
  const PicturesScene scene(cloth, static_cast<int>(environments), state.range(1) != 0);
  std::vector<float> depth(environments * picture_width * picture_height);
  std::vector<std::uint8_t> instance(depth.size());
  for (auto _ : state) {
    render(scene.lens, scene.cameras, scene.meshes, {.depth = depth.data(), .instance = instance.data()}, 1);
    benchmark::DoNotOptimize(depth.data());
  }
  const Counts counts(scene);
  state.counters["vertices"] = counts.vertices;
  state.counters["triangles"] = counts.triangles;
  state.counters["tried"] = counts.tried;
  state.counters["covered"] = counts.covered;
  state.counters["seen"] = counts.seen;
  state.counters["least"] = counts.least_seconds();
  state.counters["a_picture"] = bench::time_of_a_picture(environments);
}

void pictures_of_a_garment(benchmark::State& state) { draw_all(state, bench::garment()); }
void pictures_of_a_towel(benchmark::State& state) { draw_all(state, bench::towel()); }

void with_and_without_a_table(benchmark::internal::Benchmark* pictures) {
  pictures->ArgNames({"environments", "table"})
      ->ArgsProduct({{1, 8, 32, 128}, {0, 1}})
      ->Unit(benchmark::kMillisecond);
}

BENCHMARK(pictures_of_a_garment)->Apply(with_and_without_a_table);
BENCHMARK(pictures_of_a_towel)->Apply(with_and_without_a_table);

}  // namespace
}  // namespace flash::sim
