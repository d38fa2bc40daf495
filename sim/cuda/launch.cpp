#include "sim/cuda/launch.h"

#include <stdexcept>
#include <string>

#include "sim/cuda/out_of_memory.h"

namespace flash::sim::cuda {

void check(cudaError_t status) {
  if (status == cudaSuccess) return;
  const std::string message = std::string("CUDA: ") + cudaGetErrorString(status);
  cudaGetLastError();  // an error that has been told is not told again
  if (status == cudaErrorMemoryAllocation) throw OutOfMemory(message);
  throw std::runtime_error(message);
}

int most_memory() {
  int device = 0, bytes = 0;
  check(cudaGetDevice(&device));
  check(cudaDeviceGetAttribute(&bytes, cudaDevAttrMaxSharedMemoryPerBlockOptin, device));
  return bytes;
}

}  // namespace flash::sim::cuda
