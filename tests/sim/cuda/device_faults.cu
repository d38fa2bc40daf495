#include "tests/sim/cuda/device_faults.h"

#include <cuda_runtime.h>

namespace flash::sim::cuda {
namespace {

__global__ void trap() { __trap(); }

std::size_t free_memory() {
  std::size_t free = 0, all = 0;
  cudaMemGetInfo(&free, &all);
  return free;
}

}  // namespace

void lose_device() {
  cudaSetDevice(0);
  trap<<<1, 1>>>();
  cudaDeviceSynchronize();
}

FullDevice::FullDevice(std::size_t left) {
  cudaSetDevice(0);
  constexpr std::size_t least = std::size_t{1} << 16;
  for (std::size_t bytes = std::size_t{1} << 34; bytes >= least;) {
    void* piece = nullptr;
    if (free_memory() >= left + bytes && cudaMalloc(&piece, bytes) == cudaSuccess)
      pieces_.push_back(piece);
    else
      bytes /= 2;
  }
  cudaGetLastError();
}

FullDevice::~FullDevice() {
  for (void* piece : pieces_) cudaFree(piece);
}

}  // namespace flash::sim::cuda
