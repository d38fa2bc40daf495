#include "sim/cuda/launch.h"
#include "sim/cuda/mesh_order.h"

namespace flash::sim::cuda {
namespace {

/// A thread takes a vertex.
__global__ void order_kernel(const Point* points, const int* order, int size, long count, double* to) {
  const long k = static_cast<long>(blockIdx.x) * blockDim.x + threadIdx.x;
  if (k >= count) return;
  const long environment = k / size;
  const Point from = points[k];
  double* own = to + 3 * (environment * size + order[k - environment * size]);
  own[0] = from.x;
  own[1] = from.y;
  own[2] = from.z;
}

}  // namespace

void put_in_mesh_order(const Point* points, const int* order, int size, int environments, double* to,
                       cudaStream_t stream) {
  constexpr int threads = 256;
  const long count = static_cast<long>(size) * environments;
  const auto blocks = static_cast<unsigned>((count + threads - 1) / threads);
  order_kernel<<<blocks, threads, 0, stream>>>(points, order, size, count, to);
  check(cudaGetLastError());
}

}  // namespace flash::sim::cuda
