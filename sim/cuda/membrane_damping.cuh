#pragma once
#include "sim/cuda/membrane.cuh"
#include "sim/cuda/team_sum.cuh"

namespace flash::sim::cuda {

// The Kelvin-Voigt membrane of sim/step/strain_energy.h. A thread takes a triangle.

/// Symmetric 2 x 2.
struct Metric {
  double xx, xy, yy;
};

/// F = (f1, f2) of a triangle, and how it depends on its corners.
struct TriangleGradient {
  Triple f1, f2;
  double w[3][2];  ///< [1/m]
  double area;     ///< [m^2]

  __device__ Metric metric() const { return {dot(f1, f1), dot(f1, f2), dot(f2, f2)}; }
};

template <typename Places>
__device__ TriangleGradient triangle_gradient(const SheetTables& tables, int t, const Places& place) {
  const int count = tables.triangle_count;
  const Triple x0 = place(tables.triangle_vertices[t]);
  const Triple e1 = place(tables.triangle_vertices[count + t]) - x0,
               e2 = place(tables.triangle_vertices[2 * count + t]) - x0;
  TriangleGradient g;
#pragma unroll
  for (int a = 0; a < 2; ++a) {
    g.w[1][a] = tables.gradients[a * count + t];
    g.w[2][a] = tables.gradients[(2 + a) * count + t];
    g.w[0][a] = -(g.w[1][a] + g.w[2][a]);
  }
  g.f1 = g.w[1][0] * e1 + g.w[2][0] * e2;
  g.f2 = g.w[1][1] * e1 + g.w[2][1] * e2;
  g.area = tables.areas[t];
  return g;
}

/// Writes the metric of each triangle.
template <typename Places>
__device__ void write_metrics(const SheetTables& tables, const Places& place, double* metrics) {
  const int count = tables.triangle_count;
  for (int t = team_rank(); t < count; t += team_size()) {
    const Metric metric = triangle_gradient(tables, t, place).metric();
    metrics[t] = metric.xx;
    metrics[count + t] = metric.xy;
    metrics[2 * count + t] = metric.yy;
  }
}

/// Green's strain since the start of the step.
__device__ inline Metric strain_since(const SheetTables& tables, int t, const TriangleGradient& g,
                                      const double* metrics) {
  const int count = tables.triangle_count;
  const Metric now = g.metric();
  return {0.5 * (now.xx - metrics[t]), 0.5 * (now.xy - metrics[count + t]),
          0.5 * (now.yy - metrics[2 * count + t])};
}

/// Second Piola-Kirchhoff stress of a strain.
__device__ inline Metric stress_of(const SheetLame& lame, const Metric& strain) {
  const double trace = lame.lambda * (strain.xx + strain.yy);
  return {2 * lame.mu * strain.xx + trace, 2 * lame.mu * strain.xy, 2 * lame.mu * strain.yy + trace};
}

/// Adds to what the triangles give to their corners, as triangle_gradients (elastic_gradient.cuh) wrote it.
/// Their potential is added up at `partial`.
template <typename Places>
__device__ void add_damping_gradients(const SheetTables& tables, const EnvironmentNumbers& environment,
                                      const double* metrics, const Places& place, double* shares,
                                      double* partial) {
  const int count = tables.triangle_count;
  add_up<1>(count, partial, [&](int t, double(&potential)[1]) {
    const TriangleGradient g = triangle_gradient(tables, t, place);
    const Metric strain = strain_since(tables, t, g, metrics),
                 stress = stress_of(environment.damping, strain);
    potential[0] +=
        0.5 * g.area * (stress.xx * strain.xx + 2 * stress.xy * strain.xy + stress.yy * strain.yy);
    const Triple p1 = g.area * (stress.xx * g.f1 + stress.xy * g.f2),
                 p2 = g.area * (stress.xy * g.f1 + stress.yy * g.f2);
#pragma unroll
    for (int k = 0; k < 3; ++k) {
      const Triple force = g.w[k][0] * p1 + g.w[k][1] * p2;
      double* to = shares + 3L * k * count + t;
      to[0] += force.x;
      to[count] += force.y;
      to[2 * count] += force.z;
    }
  });
}

/// Without its negative eigenvalues.
__device__ inline Metric without_negative(const Metric& m) {
  const double mean = 0.5 * (m.xx + m.yy), half = 0.5 * (m.xx - m.yy);
  const double radius = sqrt(half * half + m.xy * m.xy), low = mean - radius, high = mean + radius;
  if (low >= 0) return m;
  if (high <= 0) return {0, 0, 0};
  const double scale = high / (high - low);
  return {scale * (m.xx - low), scale * m.xy, scale * (m.yy - low)};
}

/// Adds to the blocks (1,0), (2,0) and (2,1) of each triangle, as write_shares (membrane_hessian.cuh) wrote
/// them, `block_step` numbers from one to the next.
template <typename Places>
__device__ void add_damping_shares(const SheetTables& tables, const EnvironmentNumbers& environment,
                                   const double* metrics, const Places& place, bool positive, int block_step,
                                   float* shares) {
  const SheetLame& lame = environment.damping;
  for (int t = team_rank(); t < tables.triangle_count; t += team_size()) {
    const TriangleGradient g = triangle_gradient(tables, t, place);
    Metric stress = stress_of(lame, strain_since(tables, t, g, metrics));
    if (positive) stress = without_negative(stress);
    const double f1[3] = {g.f1.x, g.f1.y, g.f1.z}, f2[3] = {g.f2.x, g.f2.y, g.f2.z};
#pragma unroll
    for (int b = 0; b < 3; ++b) {
      const double *wi = g.w[b == 0 ? 1 : 2], *wj = g.w[b == 2 ? 1 : 0];
      const double along = lame.mu * (wi[0] * wj[0] + wi[1] * wj[1]);
      double m[2][2];
#pragma unroll
      for (int r = 0; r < 2; ++r)
#pragma unroll
        for (int c = 0; c < 2; ++c)
          m[r][c] = (r == c ? along : 0) + lame.mu * wj[r] * wi[c] + lame.lambda * wi[r] * wj[c];
      const double turned =
          wj[0] * (stress.xx * wi[0] + stress.xy * wi[1]) + wj[1] * (stress.xy * wi[0] + stress.yy * wi[1]);
      float* to = shares + static_cast<long>(block_step) * (3 * t + b);
#pragma unroll
      for (int c = 0; c < 3; ++c) {
        const double on1 = m[0][0] * f1[c] + m[0][1] * f2[c], on2 = m[1][0] * f1[c] + m[1][1] * f2[c];
#pragma unroll
        for (int r = 0; r < 3; ++r)
          to[3 * c + r] += static_cast<float>(g.area * (f1[r] * on1 + f2[r] * on2 + (r == c ? turned : 0)));
      }
    }
  }
}

}  // namespace flash::sim::cuda
