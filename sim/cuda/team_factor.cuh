#pragma once
#include "sim/cuda/replay_numbers.h"

// The factor of the matrix that solves begin with: factorize(replay, memory, chip) of its blocks, which says
// whether it is positive, and solve(fronts, factor, vector, chip) with it. Fronts on a device, one dense
// matrix in the serial team, whose sheets are small.
#ifdef __CUDACC__
#include "sim/cuda/front_factor.cuh"
#include "sim/cuda/front_solve.cuh"

namespace flash::sim::cuda {

__device__ inline bool factorize(const ReplayNumbers& replay, const TeamMemory& memory, float* chip) {
  return factorize<half_parts>(replay.fronts, memory.blocks, memory.updates, memory.factor, chip);
}

/// The factor of an environment.
__device__ inline __half* factor_of(const ReplayNumbers& replay, int environment) {
  return replay.factors + environment * replay.factor_numbers;
}

}  // namespace flash::sim::cuda
#else
#include "sim/cuda/serial_factor.h"
#endif
