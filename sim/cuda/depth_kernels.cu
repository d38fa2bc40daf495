#include "sim/cuda/depth_kernels.h"

#include "sim/cuda/launch.h"

namespace flash::sim::cuda {
namespace {

constexpr int threads = 128;        // of a block
constexpr int bands = 8;            // into which a large triangle is cut
constexpr int large_blocks = 1024;  // that take large triangles in turn

struct AtomicRaise {
  __device__ void operator()(std::uint64_t& key, std::uint64_t to) const {
    // Most hits are behind what is there already.
    if (key < to) atomicMax(reinterpret_cast<unsigned long long*>(&key), static_cast<unsigned long long>(to));
  }
};

/// A thread a vertex of one mesh; blockIdx.y is the picture.
__global__ void __launch_bounds__(threads)
    place_kernel(const __grid_constant__ PictureBatch batch, int mesh) {
  const int vertex = static_cast<int>(blockIdx.x) * threads + static_cast<int>(threadIdx.x);
  if (vertex < batch.drawn[mesh].vertices) place_vertex(batch, static_cast<int>(blockIdx.y), mesh, vertex);
}

/// A thread a triangle of one mesh; blockIdx.y is the picture.
__global__ void __launch_bounds__(threads)
    draw_kernel(const __grid_constant__ PictureBatch batch, int mesh, LargeTriangles large) {
  const int triangle = static_cast<int>(blockIdx.x) * threads + static_cast<int>(threadIdx.x);
  if (triangle >= batch.drawn[mesh].triangles) return;
  draw_triangle(batch, {static_cast<int>(blockIdx.y), mesh, triangle}, AtomicRaise{},
                [&](const LargeTriangle& left) { large.triangles[atomicAdd(large.count, 1u)] = left; });
}

/// A block a band of a large triangle.
__global__ void __launch_bounds__(threads)
    draw_large_kernel(const __grid_constant__ PictureBatch batch, LargeTriangles large) {
  const unsigned count = *large.count;
  for (unsigned i = blockIdx.x; i < count; i += gridDim.x)
    draw_tiles(batch, large.triangles[i], static_cast<int>(blockIdx.y), bands, static_cast<int>(threadIdx.x),
               threads, AtomicRaise{});
}

/// A thread a pixel; blockIdx.y is the picture.
__global__ void __launch_bounds__(threads) finish_kernel(const __grid_constant__ PictureBatch batch) {
  const int pixel = static_cast<int>(blockIdx.x) * threads + static_cast<int>(threadIdx.x);
  if (pixel < batch.pixels()) finish_pixel(batch, static_cast<int>(blockIdx.y), pixel);
}

unsigned blocks_for(int count) { return static_cast<unsigned>((count + threads - 1) / threads); }

}  // namespace

void draw_pictures(const PictureBatch& batch, std::span<const DrawnMesh> meshes, const LargeTriangles& large,
                   cudaStream_t stream) {
  const auto pictures = static_cast<unsigned>(batch.pictures);
  const std::size_t bytes = static_cast<std::size_t>(batch.pictures) * batch.pixels() * sizeof(std::uint64_t);
  check(cudaMemsetAsync(batch.yielding, 0, bytes, stream));
  check(cudaMemsetAsync(batch.solid, 0, bytes, stream));
  check(cudaMemsetAsync(large.count, 0, sizeof(unsigned), stream));
  const auto of_each = [&](auto* kernel, int count, const auto&... arguments) {
    if (count > 0) kernel<<<dim3(blocks_for(count), pictures), threads, 0, stream>>>(batch, arguments...);
  };
  for (int m = 0; m < batch.meshes; ++m) of_each(place_kernel, meshes[m].vertices, m);
  for (int m = 0; m < batch.meshes; ++m) of_each(draw_kernel, meshes[m].triangles, m, large);
  draw_large_kernel<<<dim3(large_blocks, bands), threads, 0, stream>>>(batch, large);
  of_each(finish_kernel, batch.pixels());
  check(cudaGetLastError());
}

}  // namespace flash::sim::cuda
