// Depth cameras over many environments on a CUDA device: a picture of 320 x 240 pixels of each, depth and
// instance, the scenes of render_bench.cpp. Vertices are in the memory of the device, and pictures stay there
// or come to the host. `least` is the time that a picture's bytes take [s]: vertices and triangles come once,
// depth and instance go once, at the rate at which the device copies.
#include <benchmark/benchmark.h>

#include <cstdint>
#include <deque>
#include <vector>

#include "sim/device_copies.h"
#include "sim/device_pictures.h"
#include "tests/bench/pictures_scene.h"

namespace flash::sim {
namespace {

using bench::PicturesScene, bench::picture_width, bench::picture_height;

/// As many numbers on the device, which nothing reads. Bytes and the like are taken from them.
struct DeviceRoom {
  std::vector<double> numbers;
  const double* there;
  DeviceRoom(DeviceCopies& copies, std::size_t bytes)
      : numbers(bytes / sizeof(double) + 1), there(copies.of(numbers)) {}
  template <class Number>
  Number* of() const {
    return reinterpret_cast<Number*>(const_cast<double*>(there));
  }
};

void draw_all(benchmark::State& state, const data::TriangleMesh& cloth) {
  if (!why_no_cuda().empty()) return state.SkipWithError(why_no_cuda().c_str());
  const auto environments = static_cast<std::size_t>(state.range(0));
  PicturesScene scene(cloth, static_cast<int>(environments), state.range(1) != 0);
  const bool to_host = state.range(2) != 0;
  DeviceCopies copies(0);
  std::vector<SeenMesh> kept = scene.meshes;
  kept[0].vertices.clear();
  DevicePictures device(0, kept);
  for (std::size_t e = 0; e < environments; ++e)
    scene.meshes[0].vertices[e] =
        copies.of(std::span(scene.vertices[e].data(), static_cast<std::size_t>(scene.vertices[e].size())));
  const std::size_t pixels = environments * picture_width * picture_height;
  std::vector<float> depth(pixels);
  std::vector<std::uint8_t> instance(pixels);
  const DeviceRoom depth_there(copies, 4 * pixels), instance_there(copies, pixels);
  const DepthPictures pictures = to_host ? DepthPictures{.depth = depth.data(), .instance = instance.data()}
                                         : DepthPictures{.depth = depth_there.of<float>(),
                                                         .instance = instance_there.of<std::uint8_t>()};
  for (auto _ : state)
    device.render(scene.lens, scene.cameras, scene.meshes, pictures, to_host ? Device::cpu : Device::cuda);
  const double bytes = static_cast<double>(24 * cloth.vertices.rows() + 12 * cloth.triangles.rows()) +
                       5.0 * picture_width * picture_height;
  const double seconds = bytes / (device_rates(0).copied_bytes / 2);
  state.counters["triangles"] = static_cast<double>(cloth.triangles.rows());
  state.counters["least"] = seconds;
  state.counters["a_picture"] = bench::time_of_a_picture(environments);
}

void pictures_of_a_garment(benchmark::State& state) { draw_all(state, bench::garment()); }
void pictures_of_a_towel(benchmark::State& state) { draw_all(state, bench::towel()); }

void with_and_without_a_table(benchmark::internal::Benchmark* pictures) {
  pictures->ArgNames({"environments", "table", "to_host"})
      ->ArgsProduct({{1, 8, 32, 64, 128, 1024}, {0, 1}, {0}})
      ->Args({128, 1, 1})
      ->Unit(benchmark::kMillisecond)
      ->UseRealTime();
}

BENCHMARK(pictures_of_a_garment)->Apply(with_and_without_a_table);
BENCHMARK(pictures_of_a_towel)->Apply(with_and_without_a_table);

}  // namespace
}  // namespace flash::sim
