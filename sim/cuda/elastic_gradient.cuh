#pragma once
#include "sim/cuda/membrane.cuh"
#include "sim/cuda/sheet_product.cuh"

namespace flash::sim::cuda {

// A thread takes a triangle and writes what it gives to memory of its own; then a thread takes an entry of a
// vertex, and adds up its triangles in a fixed order.

/// Membrane and bending energy [J], to all threads, and the gradient of both [N], three numbers a vertex.
/// `shares`: memory for nine numbers a triangle; `partial`: on chip, a number a warp.
inline __device__ ElasticEnergies elastic_gradient(const SheetTables& tables,
                                                   const EnvironmentNumbers& environment,
                                                   const Point* positions, double* gradient, double* shares,
                                                   double* partial) {
  const int count = tables.triangle_count;
  double membrane = 0, bending = 0;
  for (int t = static_cast<int>(threadIdx.x); t < count; t += team_threads) {
    const TriangleFrame f = triangle_frame(tables, t, positions);
    const PrincipalResponse<double> response = response_at(environment, f.frame.s1, f.frame.s2);
    const StressColumns<double> stress = stress_of(f.frame, response);
    membrane += f.area * response.energy;
    const Triple g1 = f.area * (f.w10 * stress.p1 + f.w11 * stress.p2),
                 g2 = f.area * (f.w20 * stress.p1 + f.w21 * stress.p2), g0 = -1.0 * (g1 + g2);
    const Triple all[3] = {g0, g1, g2};
#pragma unroll
    for (int k = 0; k < 3; ++k) {
      shares[(3L * k) * count + t] = all[k].x;
      shares[(3L * k + 1) * count + t] = all[k].y;
      shares[(3L * k + 2) * count + t] = all[k].z;
    }
  }
  multiply_scalar_rows(tables, tables.group_values, environment.rigidity, positions, gradient);
  __syncthreads();
  for (int i = static_cast<int>(threadIdx.x); i < 3 * tables.size; i += team_threads) {
    const int vertex = i / 3, c = i - 3 * vertex;
    const double bent = gradient[i];
    const Point& p = positions[vertex];
    bending += 0.5 * bent * (c == 0 ? p.x : c == 1 ? p.y : p.z);
    double sum = 0;
    for (int k = tables.corner_starts[vertex]; k < tables.corner_starts[vertex + 1]; ++k) {
      const int corner = tables.corners[k] / count, t = tables.corners[k] - corner * count;
      sum += shares[(3L * corner + c) * count + t];
    }
    gradient[i] = bent + sum;
  }
  return {sum_over_team(membrane, partial), sum_over_team(bending, partial)};
}

}  // namespace flash::sim::cuda
