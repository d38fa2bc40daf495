#include "sim/cuda/launch.h"

#include <string>

#include "sim/cuda/device_error.h"

namespace flash::sim::cuda {

void check(cudaError_t status) {
  if (status == cudaSuccess) return;
  int device = 0;
  const bool numbered = cudaGetDevice(&device) == cudaSuccess;
  const std::string message =
      "CUDA device" + (numbered ? " " + std::to_string(device) : "") + ": " + cudaGetErrorString(status);
  cudaGetLastError();  // an error that has been told is not told again
  if (status == cudaErrorMemoryAllocation) throw OutOfMemory(message);
  throw DeviceError(message);
}

int most_memory() {
  int device = 0, bytes = 0;
  check(cudaGetDevice(&device));
  check(cudaDeviceGetAttribute(&bytes, cudaDevAttrMaxSharedMemoryPerBlockOptin, device));
  return bytes;
}

bool launches_clusters() {
  int device = 0, clusters = 0;
  check(cudaGetDevice(&device));
  check(cudaDeviceGetAttribute(&clusters, cudaDevAttrClusterLaunch, device));
  return clusters != 0;
}

TeamLaunch::TeamLaunch(int teams, int blocks, int bytes, cudaStream_t stream) {
  config_.gridDim = dim3(static_cast<unsigned>(teams), static_cast<unsigned>(blocks));
  config_.blockDim = dim3(block_threads);
  config_.dynamicSmemBytes = static_cast<size_t>(bytes);
  config_.stream = stream;
  if (blocks == 1) return;
  cluster_.id = cudaLaunchAttributeClusterDimension;
  cluster_.val.clusterDim = {1, static_cast<unsigned>(blocks), 1};
  config_.attrs = &cluster_;
  config_.numAttrs = 1;
}

}  // namespace flash::sim::cuda
