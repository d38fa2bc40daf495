#pragma once
#include "sim/cuda/replay_numbers.h"

namespace flash::sim::cuda {

/// The next environment, -1 where none waits or the host wants to stop, and the step where it stands. By one
/// thread. What the last team wrote for it is visible to this thread and, behind a barrier, to its team.
///
/// A team that gets none is not needed any more. All environments that are not at their end are with other
/// teams, which go on with them or with what these add. So no team ever waits: polling of many teams slows
/// down those at work by a factor of several.
__device__ inline int take(const WorkQueue& queue, int* step) {
  const volatile int *taken = queue.taken, *added = queue.added, *stop = queue.stop;
  int place = *taken;
  while (true) {
    if (place >= *added || *stop != 0) return -1;
    const int found = atomicCAS(queue.taken, place, place + 1);
    if (found == place) break;
    place = found;
  }
  // Its team may have counted it and not written it yet.
  const volatile int* entry = queue.entries + place;
  while (*entry < 0) __nanosleep(100);
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
