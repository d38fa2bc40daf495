#pragma once
#include "sim/cuda/elastic_gradient.cuh"
#include "sim/cuda/replay_numbers.h"
#include "sim/cuda/rigid_turn.cuh"

namespace flash::sim::cuda {

// What one implicit Euler step minimizes, as sim/step/incremental_potential.h, with what holds vertices.

/// One step of an environment as a problem.
struct StepProblem {
  const ReplayMaterial* material;
  double h;                                 ///< [s]
  EnvironmentNumbers numbers;               ///< of this h
  const Point *start, *velocities, *loads;  ///< `loads` null without
  Restrictions restrictions;
  StepStart damped_since;
  ElasticEnergies at_start;

  __device__ double mass(const SheetTables& tables, int i) const {
    return material->areal_density * tables.vertex_area[i];
  }
  __device__ Triple gravity() const {
    return {material->gravity[0], material->gravity[1], material->gravity[2]};
  }
  __device__ Triple load(int i) const { return loads == nullptr ? Triple{0, 0, 0} : triple(loads[i]); }
  /// Displacement since the start of the step, less that without forces but gravity.
  __device__ Triple inertial(int i, const Triple& moved) const {
    return moved - h * triple(velocities[i]) - (h * h) * gravity();
  }
  /// What the constraints leave of a force. Restrictions of axes alone: their projectors are exact.
  __device__ Triple residual(int i, const Triple& force) const {
    const int k = restrictions.of_place[i];
    if (k < 0) return force;
    const float* p = restrictions.list[k].free;
    return {p[0] * force.x + p[3] * force.y + p[6] * force.z,
            p[1] * force.x + p[4] * force.y + p[7] * force.z,
            p[2] * force.x + p[5] * force.y + p[8] * force.z};
  }
};

/// A point on the way to the end of a step.
struct Iterate {
  Point* positions;
  double* force;
  ElasticEnergies elastic;
  double potential;  ///< [J]
  double residual;   ///< norm [N]
  double worst;      ///< largest residual of a vertex, as a share of its weight
};

__device__ inline Triple force_at(const double* force, int i) {
  return {force[3 * i], force[3 * i + 1], force[3 * i + 2]};
}

/// Adds the damping of a quadratic bending model to the force. Returns its potential.
__device__ inline double add_turned_damping(const SheetTables& tables, const StepProblem& step,
                                            const TeamMemory& memory, const Point* positions, double* force,
                                            double* partial) {
  const int first = static_cast<int>(threadIdx.x);
  double centres[7] = {};
  const Triple origin = triple(positions[0]), start_origin = triple(step.start[0]);
  for (int i = first; i < tables.size; i += team_threads) {
    const double mass = step.mass(tables, i);
    const Triple to = triple(positions[i]) - origin, from = triple(step.start[i]) - start_origin;
    centres[0] += mass * to.x;
    centres[1] += mass * to.y;
    centres[2] += mass * to.z;
    centres[3] += mass * from.x;
    centres[4] += mass * from.y;
    centres[5] += mass * from.z;
    centres[6] += mass;
  }
  sum_over_team(centres, partial);
  const double per_mass = 1 / centres[6];
  const Triple to_centre = origin + per_mass * Triple{centres[0], centres[1], centres[2]},
               from_centre = start_origin + per_mass * Triple{centres[3], centres[4], centres[5]};
  double sums[9] = {};
  for (int i = first; i < tables.size; i += team_threads) {
    const Triple to = step.mass(tables, i) * (triple(positions[i]) - to_centre),
                 from = triple(step.start[i]) - from_centre;
    const double left[3] = {to.x, to.y, to.z}, right[3] = {from.x, from.y, from.z};
#pragma unroll
    for (int k = 0; k < 9; ++k) sums[k] += left[k / 3] * right[k % 3];
  }
  sum_over_team(sums, partial);
  double moments[3][3];
  for (int k = 0; k < 9; ++k) moments[k / 3][k % 3] = sums[k];
  const RigidTurn turn = rigid_turn(moments);
  for (int i = first; i < tables.size; i += team_threads) {
    const Triple bent = triple(positions[i]) - to_centre - turn.turn(triple(step.start[i]) - from_centre);
    memory.bent[i] = {bent.x, bent.y, bent.z, 0};
  }
  __syncthreads();
  const double rigidity = step.numbers.damping_share * step.numbers.rigidity;
  multiply_scalar_rows(
      tables, tables.group_values, [&](int vertex) { return triple(memory.bent[vertex]); },
      [&](int row, int c, double sum) { memory.damped[3 * row + c] = rigidity * sum; });
  __syncthreads();
  double totals[4] = {};
  for (int i = first; i < tables.size; i += team_threads) {
    const Triple damped = force_at(memory.damped, i),
                 torque = cross(damped, turn.turn(triple(step.start[i]) - from_centre));
    totals[0] += 0.5 * dot(damped, triple(memory.bent[i]));
    totals[1] += torque.x;
    totals[2] += torque.y;
    totals[3] += torque.z;
  }
  sum_over_team(totals, partial);
  const Triple response = turn.respond({totals[1], totals[2], totals[3]});
  for (int i = first; i < tables.size; i += team_threads) {
    const Triple added =
        force_at(memory.damped, i) +
        step.mass(tables, i) * cross(response, turn.turn(triple(step.start[i]) - from_centre));
    force[3 * i] += added.x;
    force[3 * i + 1] += added.y;
    force[3 * i + 2] += added.z;
  }
  return totals[0];
}

/// Fills in an iterate from its positions.
template <bool places_on_chip>
__device__ __noinline__ void evaluate(const SheetTables& tables, const StepProblem& step,
                                      const TeamMemory& memory, Iterate& at) {
  double* partial = shared_memory<double>();
  double* force = at.force;
  const Point* positions = at.positions;
  __syncthreads();
  at.elastic = elastic_gradient<places_on_chip>(tables, step.numbers, step.damped_since, positions, force,
                                                {memory.triangle_gradients, memory.hinge_gradients}, partial);
  double damping = at.elastic.damping;
  if (step.damped_since.metrics != nullptr && tables.group_count > 0)
    damping += add_turned_damping(tables, step, memory, positions, force, partial);
  const double per_step = 1 / (step.h * step.h), drag = step.material->air_drag / step.h;
  double potential = 0, squares = 0, worst = 0;
  for (int i = static_cast<int>(threadIdx.x); i < tables.size; i += team_threads) {
    const double mass = step.mass(tables, i);
    const Triple moved = triple(positions[i]) - triple(step.start[i]), inertial = step.inertial(i, moved),
                 load = step.load(i);
    const Triple own = force_at(force, i) + mass * (per_step * inertial + drag * moved) - load;
    potential +=
        0.5 * mass * (per_step * dot(inertial, inertial) + drag * dot(moved, moved)) - dot(load, moved);
    force[3 * i] = own.x;
    force[3 * i + 1] = own.y;
    force[3 * i + 2] = own.z;
    const Triple residual = step.residual(i, own);
    const double squared = dot(residual, residual), share = squared / (mass * mass);
    squares += squared;
    // What is not a number counts as the worst.
    if (!(share <= worst)) worst = share;
  }
  for (int offset = 16; offset > 0; offset /= 2) {
    const double other = __shfl_xor_sync(0xffffffffu, worst, offset);
    if (!(other <= worst)) worst = other;
  }
  double sums[2] = {potential, squares};
  __syncthreads();
  if (lane() == 0) partial[2 * team_warps + warp()] = worst;
  sum_over_team(sums, partial);
  worst = 0;
  for (int w = 0; w < team_warps; ++w)
    if (!(partial[2 * team_warps + w] <= worst)) worst = partial[2 * team_warps + w];
  at.potential = sums[0] + damping + at.elastic.membrane + at.elastic.bending;
  at.residual = sqrt(sums[1]);
  at.worst = sqrt(worst) / step.material->weight_factor;
  __syncthreads();
}

/// Whether |r| <= tolerance |M g|, and no vertex misses its weight by more than 30 times as much.
__device__ inline bool balanced(const StepProblem& step, const Iterate& at, double tolerance) {
  constexpr double vertex_tolerance = 30;
  return at.worst <= vertex_tolerance * tolerance && at.residual <= tolerance * step.material->force_scale;
}

}  // namespace flash::sim::cuda
