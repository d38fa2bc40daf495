#pragma once
#include "sim/cuda/environment_numbers.h"
#include "sim/cuda/membrane.cuh"
#include "sim/cuda/sheet_product.cuh"

namespace flash::sim::cuda {

// A thread takes a triangle and writes what it gives to memory of its own; then a thread takes a vertex, and
// adds up its triangles in a fixed order. Most of what is read are the values of bending, a megabyte for
// 1,024 vertices, and most of the time goes by until they are there: so many are on their way at a time.

/// Bytes on chip: places, where they fit, and a number a warp.
__host__ __device__ inline int gradient_memory(int size, bool places_on_chip) {
  return static_cast<int>(sizeof(double)) * (team_warps + (places_on_chip ? 3 * size : 0));
}

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
#pragma unroll 6
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

/// Membrane and bending energy [J], to all threads, and the gradient of both [N], three numbers a vertex.
/// `shares`: memory for nine numbers a triangle; `chip`: gradient_memory.
template <bool places_on_chip>
__device__ ElasticEnergies elastic_gradient(const SheetTables& tables, const EnvironmentNumbers& environment,
                                            const Point* positions, double* gradient, double* shares,
                                            double* chip) {
  double *partial = chip, *near = chip + team_warps;
  const auto place = [&](int vertex) -> Triple {
    if constexpr (places_on_chip)
      return {near[3 * vertex], near[3 * vertex + 1], near[3 * vertex + 2]};
    else
      return triple(positions[vertex]);
  };
  if constexpr (places_on_chip) {
    for (int vertex = static_cast<int>(threadIdx.x); vertex < tables.size; vertex += team_threads) {
      const Point p = positions[vertex];
      near[3 * vertex] = p.x;
      near[3 * vertex + 1] = p.y;
      near[3 * vertex + 2] = p.z;
    }
    __syncthreads();
  }
  multiply_scalar_rows(tables, tables.group_values, place, [&](int row, int c, double sum) {
    gradient[3 * row + c] = environment.rigidity * sum;
  });
  const double membrane = triangle_gradients(tables, environment, place, shares);
  __syncthreads();
  const double bending = add_up_gradient(tables, place, shares, gradient);
  return {sum_over_team(membrane, partial), 0.5 * sum_over_team(bending, partial)};
}

}  // namespace flash::sim::cuda
