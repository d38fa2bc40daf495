#pragma once
#include <cuda_runtime.h>

#include "sim/cuda/layout/front_layout.h"

namespace flash::sim::cuda {

/// Throws std::runtime_error with the device's message; OutOfMemory where that is why.
void check(cudaError_t status);

/// On-chip memory that a block may ask for [bytes].
int most_memory();

/// Blocks of a team each that run at the same time with `bytes` of on-chip memory.
template <typename Kernel>
int resident_teams(Kernel* kernel, int bytes) {
  int device = 0, processors = 0, teams = 0;
  check(cudaGetDevice(&device));
  check(cudaDeviceGetAttribute(&processors, cudaDevAttrMultiProcessorCount, device));
  check(cudaFuncSetAttribute(kernel, cudaFuncAttributeMaxDynamicSharedMemorySize, bytes));
  check(cudaOccupancyMaxActiveBlocksPerMultiprocessor(&teams, kernel, team_threads, bytes));
  return processors * teams;
}

/// `teams` blocks of a kernel, with `bytes` of on-chip memory each.
template <typename... Parameters, typename... Arguments>
void launch(void (*kernel)(Parameters...), int teams, int bytes, cudaStream_t stream,
            const Arguments&... arguments) {
  cudaLaunchConfig_t config{};
  config.gridDim = dim3(static_cast<unsigned>(teams));
  config.blockDim = dim3(team_threads);
  config.dynamicSmemBytes = static_cast<size_t>(bytes);
  config.stream = stream;
  check(cudaLaunchKernelEx(&config, kernel, Parameters(arguments)...));
}

}  // namespace flash::sim::cuda
