// Depth cameras over many environments on one thread: a picture of 320 x 240 pixels of each, depth and
// instance. Counted of one picture: `vertices` and `triangles` of what is seen, `tried` pixels (centres in
// the bounding box of a triangle), `covered` ones (centres in a triangle) and `seen` ones. `a_picture` is its
// time [s] and `least` the least it takes, by the bytes that come and go through memory and the flops that
// its counts need, whatever the order (below).
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "data/mesh/procedural_mesh.h"
#include "data/mesh/tshirt.h"
#include "sim/render/depth_camera.h"

namespace flash::sim {
namespace {

using Eigen::Isometry3d, Eigen::Vector3d;

// What one thread of a server's processor reaches at best: fused operations in double precision, four at
// once, twice a cycle at 2.5 GHz, and the memory of one of its cores.
constexpr double flops_a_second = 40e9, bytes_a_second = 10e9;

constexpr int width = 320, height = 240;

/// The cloth of many environments, waved, each in its own way, and a camera over each.
struct Scene {
  data::CameraIntrinsics lens;
  data::Triangles triangles;
  std::vector<data::Points> vertices;
  data::TriangleMesh table;
  std::vector<Isometry3d> cameras;
  std::vector<SeenMesh> meshes;

  Scene(const data::TriangleMesh& cloth, int environments, bool on_table) : triangles(cloth.triangles) {
    lens.width = width, lens.height = height;
    lens.fx = lens.fy = 300, lens.cx = 0.5 * (width - 1), lens.cy = 0.5 * (height - 1);
    const Eigen::RowVector3d middle =
        0.5 * (cloth.vertices.colwise().minCoeff() + cloth.vertices.colwise().maxCoeff());
    for (int e = 0; e < environments; ++e) {
      data::Points waved = cloth.vertices.rowwise() - middle;
      for (auto vertex : waved.rowwise())
        vertex.z() += 0.02 * std::sin(15 * vertex.x() + e) * std::cos(11 * vertex.y() - 2 * e);
      vertices.push_back(std::move(waved));
      // Straight down, turned a little, from where the cloth fills the height of the picture.
      Isometry3d camera(Eigen::AngleAxisd(std::numbers::pi, Vector3d::UnitX()) *
                        Eigen::AngleAxisd(0.1 + 0.01 * e, Vector3d::UnitZ()));
      const double extent = vertices.back().col(1).maxCoeff() - vertices.back().col(1).minCoeff();
      camera.translation() = Vector3d(0, 0, 1.2 * extent * lens.fy / height);
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

struct Counts {
  double vertices = 0, triangles = 0, tried = 0, covered = 0, seen = 0;

  explicit Counts(const Scene& scene) {
    const Pinhole camera{width, height, scene.lens.fx, scene.lens.fy, scene.lens.cx, scene.lens.cy};
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
        tried += static_cast<double>(centres(at[0].u, at[1].u, at[2].u, width)) *
                 centres(at[0].v, at[1].v, at[2].v, height);
        cover(camera, at[0], at[1], at[2], [&](int, int, double) { ++covered; });
      }
    }
    for (const PixelHit& hit : see(scene.lens, scene.cameras[0], scene.meshes)) seen += hit.mesh >= 0;
  }

  /// Vertices and triangles come once, depth and instance go once.
  double bytes() const { return 24 * vertices + 12 * triangles + 5.0 * width * height; }

  /// A vertex turns (18) and goes to the image (6); a triangle has an area, three edges and a plane of depth
  /// (40); a covered pixel three numbers of edges (6), a depth (4) and a comparison; a seen one its depth
  /// (1). Pixels that are tried in vain are no need.
  double flops() const { return 24 * vertices + 40 * triangles + 11 * covered + seen; }

  double least_seconds() const { return std::max(bytes() / bytes_a_second, flops() / flops_a_second); }
};

void draw_all(benchmark::State& state, const data::TriangleMesh& cloth) {
  const auto environments = static_cast<std::size_t>(state.range(0));
  const Scene scene(cloth, static_cast<int>(environments), state.range(1) != 0);
  std::vector<float> depth(environments * width * height);
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
  state.counters["a_picture"] =
      benchmark::Counter(static_cast<double>(environments),
                         benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

void pictures_of_a_garment(benchmark::State& state) {
  data::TshirtMesh shirt;
  shirt.cell = 0.0106;
  draw_all(state, data::tshirt(shirt));
}

void pictures_of_a_towel(benchmark::State& state) {
  draw_all(state, data::rectangle({.cells_x = 31, .cells_y = 31}));
}

BENCHMARK(pictures_of_a_garment)
    ->ArgNames({"environments", "table"})
    ->ArgsProduct({{1, 8, 32, 128}, {0, 1}})
    ->Unit(benchmark::kMillisecond);
BENCHMARK(pictures_of_a_towel)
    ->ArgNames({"environments", "table"})
    ->ArgsProduct({{1, 8, 32, 128}, {0, 1}})
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace flash::sim
