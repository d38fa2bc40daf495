#pragma once
#include "sim/cuda/replay_numbers.h"

namespace flash::sim::cuda {

/// The next environment, -1 where there is none left or the host wants to stop, and the step where it stands;
/// waits for one that another team still works on. By one thread. What the last team wrote for it is visible
/// to this thread and, behind a barrier, to its team.
__device__ inline int take(const WorkQueue& queue, int* step) {
  const int place = atomicAdd(queue.taken, 1);
  if (place >= queue.size) return -1;
  const volatile int* entry = queue.entries + place;
  const volatile int* stop = queue.stop;
  if (*stop != 0) return -1;
  while (*entry < 0) {
    if (*stop != 0) return -1;
    __nanosleep(200);
  }
  const int environment = *entry;
  __threadfence();
  *step = queue.steps[environment];
  return environment;
}

/// Adds an environment that stands at `step`, with all that the team has written, behind a barrier. By one
/// thread.
__device__ inline void add(const WorkQueue& queue, int environment, int step) {
  queue.steps[environment] = step;
  __threadfence();
  atomicExch(queue.entries + atomicAdd(queue.added, 1), environment);
}

}  // namespace flash::sim::cuda
