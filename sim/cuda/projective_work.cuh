#pragma once
#include "sim/cuda/inverse_solve.cuh"
#include "sim/cuda/projective_numbers.h"
#include "sim/cuda/vertex_places.cuh"

namespace flash::sim::cuda {

/// What a team takes an environment through steps with.
template <Keeping keeping>
struct ProjectiveWork {
  const ProjectiveNumbers& numbers;
  const ProjectiveMemory& memory;
  InverseWork<keeping> inverse;
  VertexPlaces<keeping> places;
  const SolveVertex* vertices;  ///< of the factor
  double* partial;              ///< on chip

  __device__ const SheetTables& tables() const { return numbers.replay.sheet; }
};

/// Counts the time since the last call to a phase. All threads have just been synchronized.
template <typename Work>
__device__ void count_phase(const Work& w, ProjectivePhase phase) {
  PhaseClock{w.memory.clocks}.count(static_cast<ReplayPhase>(phase));
}

/// How far the last solve moves a vertex [m]. `back`: SolveScale of its right-hand side.
template <Keeping keeping>
struct SolvedWay {
  InverseWork<keeping> inverse;
  const SolveVertex* vertices;
  float back;

  __device__ SolvedWay(const ProjectiveWork<keeping>& w, float scale)
      : inverse(w.inverse), vertices(kept_whole(w.vertices)), back(scale) {}
  __device__ Vector3<float> operator()(const SolveVertex& vertex) const {
    return (back * vertex.scale) * vector_of(inverse.solution(vertex.slot));
  }
};

}  // namespace flash::sim::cuda
