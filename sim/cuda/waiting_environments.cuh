#pragma once
#include "sim/cuda/replay_numbers.h"
#include "sim/cuda/team.cuh"

namespace flash::sim::cuda {

/// What an environment at step `at` is expected to need still, in solves: as much a step as so far, and as if
/// it had taken a few expected steps before the first one.
__device__ inline float remaining_work(const WaitingEnvironments& waiting, int environment, int at) {
  constexpr float steps_before = 10;
  const float done = static_cast<float>(static_cast<const volatile int*>(waiting.work)[environment]);
  return (done + steps_before * waiting.expected[environment]) /
         (static_cast<float>(at - waiting.begins[environment]) + steps_before) *
         static_cast<float>(waiting.ends[environment] - at);
}

/// The environment with the most work left of those that wait, -1 where none does, where those that are left
/// are for larger teams, or where the host wants to stop; `step`: where it stands. By the whole team, behind
/// a barrier, its first block for all; what the last team wrote is visible to it.
///
/// A team that gets none is not needed any more. All environments that are not at their end are with other
/// teams, which go on with them or with what these give back, or wait for the teams of the next stage. So no
/// team ever waits: polling of many teams slows down those at work by a factor of several.
__device__ inline int take(const WaitingEnvironments& waiting, int* step) {
  constexpr unsigned long long none = 0;
  constexpr int again = -2;
  unsigned long long* partial = shared_memory<unsigned long long>();
  int* answer = reinterpret_cast<int*>(partial + block_warps);
  const int count = waiting.count, begin = team_index() % count;
  const auto standing = [&](int e) { return static_cast<const volatile int*>(waiting.steps)[e]; };
  const auto place = [&](int k) { return begin + k < count ? begin + k : begin + k - count; };
  while (true) {
    // Numbers that are not negative are in the order of their bits. Of equal ones each team prefers another.
    unsigned long long best = none;
    for (int k = static_cast<int>(threadIdx.x); k < count && block_of_team() == 0; k += block_threads) {
      const int e = place(k), at = standing(e);
      if (at < 0) continue;
      const unsigned work = __float_as_uint(remaining_work(waiting, e, at));
      best = max(best, static_cast<unsigned long long>(work) << 32 | static_cast<unsigned>(count - k));
    }
    for (int offset = 16; offset > 0; offset /= 2)
      best = max(best, __shfl_xor_sync(0xffffffffu, best, offset));
    if (lane() == 0) partial[warp()] = best;
    __syncthreads();
    if (team_rank() == 0) {
      for (int w = 1; w < block_warps; ++w) best = max(best, partial[w]);
      const bool leaves = *static_cast<const volatile int*>(waiting.unfinished) <= waiting.leave_at ||
                          *static_cast<const volatile int*>(waiting.stop) != 0;
      int found = -1;
      if (best != none && !leaves) {
        found = place(count - static_cast<int>(best & 0xffffffffu));
        const int at = standing(found);
        put_in_all(answer + 1, at);
        if (at < 0 || atomicCAS(waiting.steps + found, at, -1) != at) found = again;
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

/// Lets an environment wait that stands at `step`, unless it is at its end, with all that the team has
/// written, behind a barrier. `work`: what it took since it was taken, in solves. By one thread.
__device__ inline void give_back(const WaitingEnvironments& waiting, int environment, int step, int work) {
  waiting.work[environment] += work;
  __threadfence();
  if (step < waiting.ends[environment])
    atomicExch(waiting.steps + environment, step);
  else
    atomicSub(waiting.unfinished, 1);
}

}  // namespace flash::sim::cuda
