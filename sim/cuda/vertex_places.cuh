#pragma once
#include "sim/cuda/four.h"
#include "sim/cuda/membrane.cuh"
#include "sim/cuda/team.cuh"

namespace flash::sim::cuda {

__device__ inline Vector3<float> single(const Triple& v) {
  return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)};
}
__device__ inline Vector3<float> vector_of(const Four<float>& v) { return {v.x, v.y, v.z}; }

/// The positions of an iterate, as sums of two numbers of single precision: where the vertex was at the start
/// of the step, rounded, and the rest, which is as small as its motion. So differences between vertices are
/// as exact as those of positions in double precision, rounded.
template <Keeping keeping>
struct VertexPlaces {
  int begin;            ///< bytes from the start of the memory on chip
  Four<float>* memory;  ///< of the team, where they are not on chip
  int size;             ///< vertices

  __device__ Four<float>* starts() const {
    if constexpr (keeping != Keeping::memory)
      return reinterpret_cast<Four<float>*>(shared_memory<char>() + begin);
    else
      return memory;
  }
  __device__ Four<float>* rests() const { return starts() + size; }
  __device__ Triple place(int i) const {
    const Four<float> start = starts()[i], rest = rests()[i];
    return {static_cast<double>(start.x) + rest.x, static_cast<double>(start.y) + rest.y,
            static_cast<double>(start.z) + rest.z};
  }
  /// From vertex i to vertex k.
  __device__ Vector3<float> between(int i, int k) const {
    return (vector_of(starts()[k]) - vector_of(starts()[i])) +
           (vector_of(rests()[k]) - vector_of(rests()[i]));
  }
  /// Sets the rest for the whole team.
  __device__ void set_rest(int i, const Vector3<float>& rest) const {
    const Four<float> all = {rest.x, rest.y, rest.z, 0};
    put<keeping>(rests() + i, all);
  }
};

/// Takes the places of an iterate, vertices by their owners. A barrier of the team begins it, and one ends
/// it.
template <Keeping keeping>
__device__ void set_places(const VertexPlaces<keeping>& places, const Point* starts, const Point* positions) {
  const auto rounded = [&](int i) {
    const Vector3<float> start = single(triple(starts[i]));
    return Four<float>{start.x, start.y, start.z, 0};
  };
  synchronize_team();
  // Each block has its own copy.
  if constexpr (keeping != Keeping::memory)
    for (int i = static_cast<int>(threadIdx.x); i < places.size; i += block_threads)
      places.starts()[i] = rounded(i);
  else
    for (int i = team_rank(); i < places.size; i += team_size()) places.starts()[i] = rounded(i);
  for (int i = team_rank(); i < places.size; i += team_size()) {
    const Four<float> start = rounded(i);
    places.set_rest(i, single(triple(positions[i]) - Triple{start.x, start.y, start.z}));
  }
  synchronize_team();
}

}  // namespace flash::sim::cuda
