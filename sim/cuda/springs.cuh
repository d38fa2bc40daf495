#pragma once
#include "sim/cuda/membrane.cuh"
#include "sim/cuda/replay_numbers.h"
#include "sim/cuda/team.cuh"

namespace flash::sim::cuda {

// Springs of soft holds, as sim/step/springs.h. Few vertices have some, so lone threads add what they give:
// an environment without them pays nothing. Those of a vertex stand one behind the other.

/// The springs of a part of a time step, which goes over the shares from `begin` to `end` of it. Their places
/// go on the parabolas of HeldVertex within the step.
struct Springs {
  const SpringPlace* list = nullptr;
  int count = 0;
  const double* stiffness = nullptr;  ///< of the environment, by entry [N/m]
  double begin = 0, end = 1;

  __device__ Triple place(int k) const { return between(list[k], end); }
  /// What the place moves by in the part.
  __device__ Triple moved(int k) const { return place(k) - between(list[k], begin); }
  /// Along each axis [N/m].
  __device__ Triple along_axes(int k) const {
    const int axes = list[k].axes;
    const double own = stiffness[list[k].entry];
    return {axes & 1 ? own : 0, axes & 2 ? own : 0, axes & 4 ? own : 0};
  }
  /// On the vertex at x [N].
  __device__ Triple force(int k, const Triple& x) const {
    const Triple own = along_axes(k), stretched = place(k) - x;
    return {own.x * stretched.x, own.y * stretched.y, own.z * stretched.z};
  }
  /// With the vertex at x [J].
  __device__ double energy(int k, const Triple& x) const { return 0.5 * dot(force(k, x), place(k) - x); }

  __device__ bool is_first_of_vertex(int k) const { return k == 0 || list[k - 1].place != list[k].place; }

 private:
  __device__ static Triple between(const SpringPlace& own, double share) {
    const Triple from = {own.from[0], own.from[1], own.from[2]}, to = {own.to[0], own.to[1], own.to[2]},
                 bow = {own.bow[0], own.bow[1], own.bow[2]};
    return share == 1 ? to : from + share * (to - from + (1 - share) * bow);
  }
};

/// act(spring) for those of the vertex of spring k, of which it is the first.
template <typename Act>
__device__ void for_springs_of_vertex(const Springs& springs, int k, const Act& act) {
  const int place = springs.list[k].place;
  for (; k < springs.count && springs.list[k].place == place; ++k) act(k);
}

/// act(spring) by a thread for each vertex that has springs: its first one.
template <typename Act>
__device__ void for_sprung_vertices(const Springs& springs, const Act& act) {
  for (int k = team_rank(); k < springs.count; k += team_size())
    if (springs.is_first_of_vertex(k)) act(k);
}

/// Adds the stiffness of springs to the diagonal blocks, nine numbers a vertex.
__device__ inline void add_spring_stiffness(const Springs& springs, float* blocks) {
  for_sprung_vertices(springs, [&](int first) {
    float* own = blocks + 9L * springs.list[first].place;
    Triple sum{};
    for_springs_of_vertex(springs, first, [&](int k) { sum = sum + springs.along_axes(k); });
    own[0] += static_cast<float>(sum.x);
    own[4] += static_cast<float>(sum.y);
    own[8] += static_cast<float>(sum.z);
  });
}

}  // namespace flash::sim::cuda
