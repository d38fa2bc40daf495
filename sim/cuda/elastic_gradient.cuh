#pragma once
#include "sim/cuda/environment_numbers.h"
#include "sim/cuda/membrane.cuh"
#include "sim/cuda/sheet_product.cuh"

namespace flash::sim::cuda {

// Energies and gradients of one environment or two, which then share what is read of the plan: a megabyte of
// bending values for 1,024 vertices, by far the most. A thread takes a triangle and writes what it gives to
// memory of its own; then a thread takes a vertex, and adds up its triangles in a fixed order.

/// Bytes on chip: places, where they fit, and a number a warp.
__host__ __device__ inline int gradient_memory(int size, int together, bool places_on_chip) {
  return static_cast<int>(sizeof(double)) * (team_warps + (places_on_chip ? 3 * size * together : 0));
}

/// The environments of a team and its memory.
struct GradientTask {
  int together, first, last;  ///< the team's environments from `first` on; no more than `last` there are
  const EnvironmentNumbers* environments;
  const Point* positions;
  double* gradients;
  ElasticEnergies* energies;
  double* shares;  ///< nine numbers a triangle

  /// Where a second environment is missing, the last one stands for it.
  __device__ int environment(int e) const { return min(first + e, last); }
};

/// What the triangles of one environment give to `shares`. Returns the energy of the thread's own.
template <typename Places>
__device__ double triangle_gradients(const SheetTables& tables, const EnvironmentNumbers& environment,
                                     const Places& place, double* shares) {
  const int count = tables.triangle_count;
  double membrane = 0;
  for (int t = static_cast<int>(threadIdx.x); t < count; t += team_threads) {
    const TriangleFrame f = triangle_frame(tables, t, place);
    const PrincipalResponse<double> response = response_at(environment, f.frame.s1, f.frame.s2);
    const StressColumns<double> stress = stress_of(f.frame, response);
    membrane += f.area * response.energy;
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
  }
  return membrane;
}

/// Adds the triangles' shares to the gradient, in which that of bending stands. Returns twice the bending
/// energy of the thread's own vertices.
template <typename Places>
__device__ double add_up_gradient(const SheetTables& tables, const Places& place, const double* shares,
                                  double* gradient) {
  double bending = 0;
  for (int vertex = static_cast<int>(threadIdx.x); vertex < tables.size; vertex += team_threads) {
    double* own = gradient + 3 * vertex;
    const Triple p = place(vertex), bent = {own[0], own[1], own[2]};
    bending += dot(bent, p);
    Triple sum = {0, 0, 0};
#pragma unroll 2
    for (int k = tables.corner_starts[vertex]; k < tables.corner_starts[vertex + 1]; ++k) {
      const double* share = shares + tables.corners[k];
      sum = sum + Triple{share[0], share[tables.triangle_count], share[2 * tables.triangle_count]};
    }
    own[0] = bent.x + sum.x;
    own[1] = bent.y + sum.y;
    own[2] = bent.z + sum.z;
  }
  return bending;
}

/// Membrane and bending energy [J], and the gradient of both [N], three numbers a vertex. `chip`:
/// gradient_memory.
template <bool places_on_chip>
__device__ void elastic_gradients(const SheetTables& tables, const GradientTask& task, double* chip) {
  const int size = tables.size;
  double *partial = chip, *near = chip + team_warps;
  const auto positions = [&](int e) { return task.positions + static_cast<long>(size) * task.environment(e); };
  const auto gradient = [&](int e) { return task.gradients + 3L * size * task.environment(e); };
  const auto place = [&](int e, int vertex) -> Triple {
    if constexpr (places_on_chip) {
      const double* own = near + 3 * (e * size + vertex);
      return {own[0], own[1], own[2]};
    }
    return triple(positions(e)[vertex]);
  };
  if constexpr (places_on_chip) {
    for (int e = 0; e < task.together; ++e)
      for (int vertex = static_cast<int>(threadIdx.x); vertex < size; vertex += team_threads) {
        const Point& p = positions(e)[vertex];
        double* own = near + 3 * (e * size + vertex);
        own[0] = p.x;
        own[1] = p.y;
        own[2] = p.z;
      }
    __syncthreads();
  }
  multiply_scalar_rows(tables, tables.group_values, task.together, place,
                       [&](int e, int row, int c, double sum) {
                         if (task.first + e > task.last) return;
                         gradient(e)[3 * row + c] = task.environments[task.environment(e)].rigidity * sum;
                       });
#pragma unroll 1
  for (int e = 0; e < task.together && task.first + e <= task.last; ++e) {
    const auto own_place = [&](int vertex) { return place(e, vertex); };
    const double membrane =
        triangle_gradients(tables, task.environments[task.environment(e)], own_place, task.shares);
    __syncthreads();
    const double bending = add_up_gradient(tables, own_place, task.shares, gradient(e));
    const ElasticEnergies energies = {sum_over_team(membrane, partial),
                                      0.5 * sum_over_team(bending, partial)};
    if (threadIdx.x == 0) task.energies[task.environment(e)] = energies;
    __syncthreads();
  }
}

}  // namespace flash::sim::cuda
