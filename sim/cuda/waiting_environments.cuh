#pragma once
#include "sim/cuda/replay_numbers.h"
#include "sim/cuda/team.cuh"

namespace flash::sim::cuda {

/// The environment that is furthest behind of those that wait, -1 where none does or the host wants to stop;
/// `step`: where it stands. By the whole team, behind a barrier, its first block for all; what the last team
/// wrote is visible to it.
///
/// A team that gets none is not needed any more. All environments that are not at their end are with other
/// teams, which go on with them or with what these add. So no team ever waits: polling of many teams slows
/// down those at work by a factor of several.
__device__ inline int take(const WaitingEnvironments& waiting, int* step) {
  constexpr unsigned long long none = ~0ull;
  constexpr int again = -2;
  unsigned long long* partial = shared_memory<unsigned long long>();
  int* answer = reinterpret_cast<int*>(partial + block_warps);
  const int count = waiting.count, begin = team_index() % count;
  while (true) {
    // Of equal ones each team prefers another.
    unsigned long long best = none;
    for (int k = static_cast<int>(threadIdx.x); k < count && block_of_team() == 0; k += block_threads) {
      const int e = begin + k < count ? begin + k : begin + k - count;
      const int at = static_cast<const volatile int*>(waiting.steps)[e];
      if (at >= 0) best = min(best, static_cast<unsigned long long>(at) << 32 | static_cast<unsigned>(k));
    }
    for (int offset = 16; offset > 0; offset /= 2)
      best = min(best, __shfl_xor_sync(0xffffffffu, best, offset));
    if (lane() == 0) partial[warp()] = best;
    __syncthreads();
    if (team_rank() == 0) {
      for (int w = 1; w < block_warps; ++w) best = min(best, partial[w]);
      int found = -1;
      if (best != none && *static_cast<const volatile int*>(waiting.stop) == 0) {
        const int k = static_cast<int>(best & 0xffffffffu), at = static_cast<int>(best >> 32);
        found = begin + k < count ? begin + k : begin + k - count;
        if (atomicCAS(waiting.steps + found, at, -1) != at) found = again;
        put_in_all(answer + 1, at);
      }
      __threadfence();
      put_in_all(answer, found);
    }
    synchronize_team();
    const int found = answer[0];
    *step = answer[1];
    synchronize_team();
    if (found != again) return found;
  }
}

/// Lets an environment wait that stands at `step`, with all that the team has written, behind a barrier. By
/// one thread.
__device__ inline void add(const WaitingEnvironments& waiting, int environment, int step) {
  __threadfence();
  atomicExch(waiting.steps + environment, step);
}

}  // namespace flash::sim::cuda
