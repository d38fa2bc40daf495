#pragma once
#include <cuda_runtime.h>

#include "sim/cuda/layout/front_layout.h"

namespace flash::sim::cuda {

/// Throws std::runtime_error with the device's message; OutOfMemory where that is why.
void check(cudaError_t status);

/// On-chip memory that a block may ask for [bytes].
int most_memory();

/// Whether the blocks of a team may lie on several processors.
bool launches_clusters();

/// A launch of teams of so many blocks, with `bytes` of on-chip memory each. It stays where it is made.
class TeamLaunch {
 public:
  TeamLaunch(int teams, int blocks, int bytes, cudaStream_t stream);
  TeamLaunch(const TeamLaunch&) = delete;
  const cudaLaunchConfig_t& config() const { return config_; }

 private:
  cudaLaunchAttribute cluster_{};
  cudaLaunchConfig_t config_{};
};

/// Teams of so many blocks that run at the same time with `bytes` of on-chip memory for each block.
template <typename Kernel>
int resident_teams(Kernel* kernel, int bytes, int blocks = 1) {
  int device = 0, processors = 0, teams = 0;
  check(cudaFuncSetAttribute(kernel, cudaFuncAttributeMaxDynamicSharedMemorySize, bytes));
  if (blocks > 1) {
    check(cudaOccupancyMaxActiveClusters(&teams, kernel, &TeamLaunch(1, blocks, bytes, nullptr).config()));
    return teams;
  }
  check(cudaGetDevice(&device));
  check(cudaDeviceGetAttribute(&processors, cudaDevAttrMultiProcessorCount, device));
  check(cudaOccupancyMaxActiveBlocksPerMultiprocessor(&teams, kernel, block_threads, bytes));
  return processors * teams;
}

template <typename... Parameters, typename... Arguments>
void launch(void (*kernel)(Parameters...), const TeamLaunch& teams, const Arguments&... arguments) {
  check(cudaLaunchKernelEx(&teams.config(), kernel, Parameters(arguments)...));
}

}  // namespace flash::sim::cuda
