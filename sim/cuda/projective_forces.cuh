#pragma once
#include "sim/cuda/elastic_gradient.cuh"
#include "sim/cuda/incremental_potential.cuh"
#include "sim/cuda/own_vertices.cuh"
#include "sim/cuda/projective_numbers.h"
#include "sim/cuda/vertex_places.cuh"
#include "sim/law/membrane_stress.h"

namespace flash::sim::cuda {

// What each vertex needs from outside at an iterate of the projective method, in single precision. Elements
// see differences between vertices, and bending what vertices have moved by in the step: so what is lost is
// a 2^-24th of stresses. Damping and hinges, which few have, go by the formulas in double precision.

/// Whether forces take the way in double precision.
__device__ inline bool needs_double(const SheetTables& tables, const StepProblem& step) {
  return tables.hinge_count > 0 || step.damped_since.metrics != nullptr;
}

/// What triangles give to their corners, to m.shares.
template <Keeping keeping>
__device__ void write_triangle_shares(const ProjectiveNumbers& numbers, const ProjectiveMemory& m,
                                      const EnvironmentNumbers& environment,
                                      const VertexPlaces<keeping>& places) {
  struct Loaded {
    int4 corners;  ///< its vertices, and the bits of its area
    Four<float> w;
  };
  const auto mu = static_cast<float>(environment.lame.mu),
             lambda = static_cast<float>(environment.lame.lambda);
  const MembraneLaw law = environment.law;
  const int4* corners = kept_whole(numbers.triangle_corners);
  const Four<float>* gradients = kept_whole(numbers.triangle_gradients);
  Four<float>* shares = kept_whole(m.shares);
  for_own_vertices(
      numbers.replay.sheet.triangle_count,
      [&](int t) {
        return Loaded{corners[t], gradients[t]};
      },
      [&](int t, const Loaded& own) {
        const Four<float>& w = own.w;
        const Vector3<float> e1 = places.between(own.corners.x, own.corners.y),
                             e2 = places.between(own.corners.x, own.corners.z);
        Vector3<float> p1, p2;
        membrane_stress(law, mu, lambda, w.x * e1 + w.z * e2, w.y * e1 + w.w * e2, p1, p2);
        const float area = __int_as_float(own.corners.w);
        const Vector3<float> g1 = area * (w.x * p1 + w.y * p2), g2 = area * (w.z * p1 + w.w * p2);
        Four<float>* to = shares + 3L * t;
        to[0] = {-(g1.x + g2.x), -(g1.y + g2.y), -(g1.z + g2.z), 0};
        to[1] = {g1.x, g1.y, g1.z, 0};
        to[2] = {g2.x, g2.y, g2.z, 0};
      });
}

/// What triangles give to a vertex with the corners from `begin` to `end`.
__device__ inline Vector3<float> membrane_force(const int* corner_shares, const Four<float>* shares,
                                                int begin, int end) {
  // Most vertices have no more corners than this; what they read is on its way together.
  constexpr int together = 6;
  Vector3<float> sum = {0, 0, 0};
  for (int first = begin; first < end; first += together) {
    int of[together];
    Four<float> own[together];
#pragma unroll
    for (int k = 0; k < together; ++k) of[k] = corner_shares[min(first + k, end - 1)];
#pragma unroll
    for (int k = 0; k < together; ++k) own[k] = shares[of[k]];
#pragma unroll
    for (int k = 0; k < together; ++k)
      if (first + k < end) sum = sum + vector_of(own[k]);
  }
  return sum;
}

/// The part of the forces that is the same in all iterations of a step: what bending gives where vertices
/// start, loads, and inertia, which pulls on with the velocity. Makes m.pulls, so that the force of a vertex
/// with the rest r of its place is what its elements give for r, and pull.w r - pull. Barriers of the team.
template <Keeping keeping>
__device__ __noinline__ void begin_forces(const SheetTables& tables, const ProjectiveMemory& m,
                                          const StepProblem& step, const VertexPlaces<keeping>& places) {
  const Four<float>* starts = places.starts();
  const Four<float> origin = starts[0];
  const auto place = [&](int vertex) -> Triple {
    const Four<float> start = starts[vertex];
    return {static_cast<double>(start.x) - origin.x, static_cast<double>(start.y) - origin.y,
            static_cast<double>(start.z) - origin.z};
  };
  multiply_scalar_rows<double>(
      tables, StepsInMemory<double>{tables.step_values}, place,
      [&](int row, int c, double sum) { m.force[3 * row + c] = step.numbers.rigidity * sum; });
  synchronize_team();
  const double per_step = 1 / (step.h * step.h), drag = step.material->air_drag / step.h;
  for (int i = team_rank(); i < step.size; i += team_size()) {
    const double mass = step.mass(tables, i), inertia = mass * (per_step + drag);
    const Triple start = triple(step.start[i]);
    const Four<float> rounded = starts[i];
    const Triple rounding = start - Triple{rounded.x, rounded.y, rounded.z};
    const Triple pull = inertia * rounding - (mass * per_step) * step.inertial(i, {0, 0, 0}) + step.load(i) -
                        force_at(m.force, i);
    m.pulls[i] = {static_cast<float>(pull.x), static_cast<float>(pull.y), static_cast<float>(pull.z),
                  static_cast<float>(inertia)};
  }
}

/// The forces in double precision, of m.positions. Barriers of the team.
__device__ __noinline__ inline void find_forces_in_double(const SheetTables& tables,
                                                          const ProjectiveMemory& m, const StepProblem& step,
                                                          double* partial) {
  elastic_gradient<false>(tables, step.numbers, step.damped_since, m.positions, m.force,
                          {m.triangle_gradients, m.hinge_gradients}, partial);
  if (step.damped_since.metrics != nullptr && tables.bundle_count > 0) {
    TeamMemory turned = {};
    turned.bent = m.bent;
    turned.damped = m.damped;
    add_turned_damping(tables, step, turned, m.positions, m.force, partial);
  }
  const double per_step = 1 / (step.h * step.h), drag = step.material->air_drag / step.h;
  for (int i = team_rank(); i < step.size; i += team_size()) {
    const double mass = step.mass(tables, i);
    const Triple moved = triple(m.positions[i]) - triple(step.start[i]);
    const Triple own =
        force_at(m.force, i) + mass * (per_step * step.inertial(i, moved) + drag * moved) - step.load(i);
    m.forces[i] = {static_cast<float>(own.x), static_cast<float>(own.y), static_cast<float>(own.z), 0};
  }
}

/// What each vertex needs from outside, to m.forces [N]; a thread reads those of its own vertices. A barrier
/// of the team begins it.
template <Keeping keeping>
__device__ __noinline__ void find_forces(const ProjectiveNumbers& numbers, const ProjectiveMemory& m,
                                         const StepProblem& step, VertexPlaces<keeping> places,
                                         double* partial) {
  const SheetTables& tables = numbers.replay.sheet;
  synchronize_team();
  if (needs_double(tables, step)) {
    find_forces_in_double(tables, m, step, partial);
    return;
  }
  write_triangle_shares(numbers, m, step.numbers, places);
  const Four<float>* rests = places.rests();
  float* bending = kept_whole(m.bending);
  multiply_scalar_rows<float>(
      tables, StepsInMemory<float>{tables.single_step_values},
      [&](int vertex) { return vector_of(rests[vertex]); },
      [&](int row, int c, float sum) { bending[3 * row + c] = sum; });
  synchronize_team();
  struct Loaded {
    int begin, end;
    Four<float> pull;
    Vector3<float> bent;
  };
  const auto rigidity = static_cast<float>(step.numbers.rigidity);
  const int *corner_starts = kept_whole(tables.corner_starts), *corners = kept_whole(numbers.corner_shares);
  const Four<float>*pulls = kept_whole(m.pulls), *shares = kept_whole(m.shares);
  Four<float>* forces = kept_whole(m.forces);
  for_own_vertices(
      step.size,
      [&](int i) {
        return Loaded{corner_starts[i],
                      corner_starts[i + 1],
                      pulls[i],
                      {bending[3 * i], bending[3 * i + 1], bending[3 * i + 2]}};
      },
      [&](int i, const Loaded& own) {
        const Vector3<float> force = membrane_force(corners, shares, own.begin, own.end) +
                                     rigidity * own.bent +
                                     (own.pull.w * vector_of(rests[i]) - vector_of(own.pull));
        forces[i] = {force.x, force.y, force.z, 0};
      });
}

}  // namespace flash::sim::cuda
