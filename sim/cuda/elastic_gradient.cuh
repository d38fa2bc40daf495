#pragma once
#include "sim/cuda/environment_numbers.h"
#include "sim/cuda/hinges.cuh"
#include "sim/cuda/membrane.cuh"
#include "sim/cuda/membrane_damping.cuh"
#include "sim/cuda/sheet_product.cuh"
#include "sim/cuda/team_sum.cuh"

namespace flash::sim::cuda {

// A thread takes a triangle and writes what it gives to memory of its own; then a thread takes a vertex, and
// adds up its triangles in a fixed order. Most of what is read are the values of bending, a megabyte for
// 1,024 vertices, and most of the time goes by until they are there: so many are on their way at a time.

/// Bytes on chip: sums over the team and places, where they fit.
FLASH_HOST_DEVICE inline int gradient_memory(int size, bool places_on_chip) {
  return static_cast<int>(sizeof(double)) * (most_sums * seats + (places_on_chip ? 3 * size : 0));
}

/// Bytes of what the triangles give.
FLASH_HOST_DEVICE inline int gradient_share_memory(int triangles) {
  return 9 * static_cast<int>(sizeof(double)) * triangles;
}

/// What elements give to their vertices: nine numbers a triangle, twelve a hinge.
struct GradientShares {
  double *triangles, *hinges;
};

/// What the triangles of one environment give to `shares`. Their energy is added up at `partial`.
template <typename Places>
__device__ void triangle_gradients(const SheetTables& tables, const EnvironmentNumbers& environment,
                                   const Places& place, double* shares, double* partial) {
  const int count = tables.triangle_count;
  add_up<1>(count, partial, [&](int t, double(&membrane)[1]) {
    const TriangleFrame f = triangle_frame(tables, t, place);
    const PrincipalResponse<double> response = response_at(environment, f.frame.s1, f.frame.s2);
    const StressColumns<double> stress = stress_of(f.frame, response);
    membrane[0] += f.area * response.energy;
    const Triple g1 = f.area * (f.w10 * stress.p1 + f.w11 * stress.p2),
                 g2 = f.area * (f.w20 * stress.p1 + f.w21 * stress.p2), g0 = -1.0 * (g1 + g2);
    const Triple all[3] = {g0, g1, g2};
#pragma unroll
    for (int k = 0; k < 3; ++k) {
      double* to = shares + 3L * k * count + t;
      to[0] = all[k].x;
      to[count] = all[k].y;
      to[2 * count] = all[k].z;
    }
  });
}

/// Adds the triangles' shares to the gradient, in which that of bending stands. Twice the bending energy is
/// added up at `partial`.
template <typename Places>
__device__ void add_up_gradient(const SheetTables& tables, const Places& place, const double* shares,
                                const double* hinge_shares, double* gradient, double* partial) {
  add_up<1>(tables.size, partial, [&](int vertex, double(&bending)[1]) {
    double* own = gradient + 3 * vertex;
    const Triple p = place(vertex), bent = {own[0], own[1], own[2]};
    bending[0] += dot(bent, p);
    Triple sum = {0, 0, 0};
    if (tables.hinge_count > 0) sum = hinge_gradient_of(tables, vertex, hinge_shares);
    // Most vertices have no more corners than this; what they read is on its way together.
    constexpr int together = 6;
    const int end = tables.corner_starts[vertex + 1];
    for (int first = tables.corner_starts[vertex]; first < end; first += together) {
      int corners[together];
      Triple given[together];
#pragma unroll
      for (int k = 0; k < together; ++k) corners[k] = tables.corners[min(first + k, end - 1)];
#pragma unroll
      for (int k = 0; k < together; ++k) {
        const double* share = shares + corners[k];
        given[k] = {share[0], share[tables.triangle_count], share[2 * tables.triangle_count]};
      }
#pragma unroll
      for (int k = 0; k < together; ++k)
        if (first + k < end) sum = sum + given[k];
    }
    own[0] = bent.x + sum.x;
    own[1] = bent.y + sum.y;
    own[2] = bent.z + sum.z;
  });
}

/// Membrane and bending energy [J], to all threads, and the gradient of both [N], three numbers a vertex;
/// with the damping of elements since `start`. `chip`: gradient_memory, free for all threads. `ring`: behind
/// that, where `shares` may be too.
template <bool places_on_chip>
__device__ ElasticEnergies elastic_gradient(const SheetTables& tables, const EnvironmentNumbers& environment,
                                            const StepStart& start, const Point* positions, double* gradient,
                                            const GradientShares& shares, double* chip,
                                            const StepRing& ring = {}) {
  double* near = chip + most_sums * seats;
  enum { membrane, bending, damping, hinges, hinge_damping };  // sums
  const auto sums = [&](int k) { return chip + seats * k; };
  StepsOnTheirWay<double> steps(tables, tables.step_values, ring);
  // Far from the origin places would round the energy of bending.
  const Triple origin = triple(positions[0]);
  const auto place = [&](int vertex) -> Triple {
    if constexpr (places_on_chip)
      return {near[3 * vertex], near[3 * vertex + 1], near[3 * vertex + 2]};
    else
      return triple(positions[vertex]) - origin;
  };
  if constexpr (places_on_chip) {
    for (int vertex = block_rank(); vertex < tables.size; vertex += block_size()) {
      const Triple p = triple(positions[vertex]) - origin;
      near[3 * vertex] = p.x;
      near[3 * vertex + 1] = p.y;
      near[3 * vertex + 2] = p.z;
    }
    synchronize_team();
  }
  multiply_scalar_rows(tables, tables.step_values, steps, place, [&](int row, int c, double sum) {
    gradient[3 * row + c] = environment.rigidity * sum;
  });
  if (steps.are_sent()) synchronize_block();
  triangle_gradients(tables, environment, place, shares.triangles, sums(membrane));
  if (tables.hinge_count > 0)
    hinge_gradients(tables, environment, start.angles, place, shares.hinges, sums(hinges));
  if (start.metrics != nullptr)
    add_damping_gradients(tables, environment, start.metrics, place, shares.triangles, sums(damping));
  synchronize_team();
  add_up_gradient(tables, place, shares.triangles, shares.hinges, gradient, sums(bending));
  synchronize_team();
  ElasticEnergies energies = {total(tables.triangle_count, sums(membrane)),
                              0.5 * total(tables.size, sums(bending)), 0};
  if (start.metrics != nullptr) energies.damping += total(tables.triangle_count, sums(damping));
  if (tables.hinge_count > 0) {
    energies.bending += total(tables.hinge_count, sums(hinges));
    energies.damping += total(tables.hinge_count, sums(hinge_damping));
  }
  return energies;
}

}  // namespace flash::sim::cuda
