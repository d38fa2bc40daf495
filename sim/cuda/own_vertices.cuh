#pragma once
#include "sim/cuda/team.cuh"

namespace flash::sim::cuda {

/// Goes through the vertices i, i + team_size(), ... of a thread, `together` at a time: first load(i) of all
/// of them, so that what they read is on its way at the same time, then use(i, what was loaded) of each.
template <int together = 2, typename Load, typename Use>
__device__ void for_own_vertices(int size, const Load& load, const Use& use) {
  const int step = team_size();
  for (int base = team_rank(); base < size; base += together * step) {
    decltype(load(0)) loaded[together];
#pragma unroll
    for (int k = 0; k < together; ++k) loaded[k] = load(min(base + k * step, size - 1));
#pragma unroll
    for (int k = 0; k < together; ++k)
      if (base + k * step < size) use(base + k * step, loaded[k]);
  }
}

/// The same in three parts, where what fetch(i, what was loaded) reads follows from that: use(i, what was
/// loaded, what was fetched).
template <int together = 2, typename Load, typename Fetch, typename Use>
__device__ void for_own_vertices(int size, const Load& load, const Fetch& fetch, const Use& use) {
  const int step = team_size();
  for (int base = team_rank(); base < size; base += together * step) {
    decltype(load(0)) loaded[together];
#pragma unroll
    for (int k = 0; k < together; ++k) loaded[k] = load(min(base + k * step, size - 1));
    decltype(fetch(0, loaded[0])) fetched[together];
#pragma unroll
    for (int k = 0; k < together; ++k) fetched[k] = fetch(min(base + k * step, size - 1), loaded[k]);
#pragma unroll
    for (int k = 0; k < together; ++k)
      if (base + k * step < size) use(base + k * step, loaded[k], fetched[k]);
  }
}

}  // namespace flash::sim::cuda
