#pragma once
#include "sim/cuda/four.h"
#include "sim/cuda/membrane.cuh"
#include "sim/cuda/team_sum.cuh"

namespace flash::sim::cuda {

// Hinges by the formulas of sim/plan/hinge_bending.h, a thread a hinge. The matrix of a hinge, Gauss and
// Newton's, is a g g^T with twelve numbers g: a product needs g^T x of each hinge, and no blocks.

/// The edges of a hinge from its first vertex, and the normals of its triangles, twice their areas long.
struct HingeShape {
  Triple x[4];
  Triple edge, left, right;
  double length;
  double shares[2], slopes[2];  ///< how far each triangle takes part, and its derivative by the area
};

template <typename Places>
__device__ HingeShape hinge_shape(const SheetTables& tables, int e, const Places& place) {
  const int count = tables.hinge_count;
  HingeShape s;
#pragma unroll
  for (int k = 0; k < 4; ++k) s.x[k] = place(tables.hinge_vertices[k * count + e]);
  s.edge = s.x[1] - s.x[0];
  s.left = cross(s.edge, s.x[2] - s.x[0]);
  s.right = cross(s.x[0] - s.x[1], s.x[3] - s.x[1]);
  s.length = sqrt(dot(s.edge, s.edge));
#pragma unroll
  for (int k = 0; k < 2; ++k) {
    const Triple& normal = k == 0 ? s.left : s.right;
    const double full = collapsed_share * tables.hinge_rest_areas[k * count + e],
                 u = 0.5 * sqrt(dot(normal, normal)) / full;
    s.shares[k] = u >= 1 ? 1 : u * u * u * (10 - 15 * u + 6 * u * u);
    s.slopes[k] = u >= 1 ? 0 : 30 * u * u * (1 - u) * (1 - u) / full;
  }
  return s;
}

__device__ inline double angle_of(const HingeShape& s) {
  return atan2(dot(cross(s.left, s.right), (1 / s.length) * s.edge), dot(s.left, s.right));
}

/// The short way round.
__device__ inline double deviation(double angle, double from) {
  constexpr double full_turn = 6.283185307179586476925;
  return remainder(angle - from, full_turn);
}

/// The derivative of the angle by the four vertices.
__device__ inline void angle_gradient(const HingeShape& s, Triple (&g)[4]) {
  g[0] = g[1] = {0, 0, 0};
#pragma unroll
  for (int opposite = 2; opposite < 4; ++opposite) {
    const Triple& normal = opposite == 2 ? s.left : s.right;
    const Triple q = (1 / dot(normal, normal)) * normal;
    g[0] = g[0] - (dot(s.x[opposite] - s.x[1], s.edge) / s.length) * q;
    g[1] = g[1] + (dot(s.x[opposite] - s.x[0], s.edge) / s.length) * q;
    g[opposite] = -s.length * q;
  }
}

/// Adds `factor` times the gradient of the area of the triangle (a, b, c).
__device__ inline void add_area_gradient(const HingeShape& s, int a, int b, int c, double factor,
                                         Triple (&g)[4]) {
  const Triple long_normal = cross(s.x[b] - s.x[a], s.x[c] - s.x[a]);
  const Triple normal = (0.5 * factor / sqrt(dot(long_normal, long_normal))) * long_normal;
  g[a] = g[a] + cross(normal, s.x[c] - s.x[b]);
  g[b] = g[b] + cross(normal, s.x[a] - s.x[c]);
  g[c] = g[c] + cross(normal, s.x[b] - s.x[a]);
}

template <typename Places>
__device__ void write_angles(const SheetTables& tables, const Places& place, double* angles) {
  for (int e = team_rank(); e < tables.hinge_count; e += team_size())
    angles[e] = angle_of(hinge_shape(tables, e, place));
}

/// What the hinges give to `shares`: twelve numbers each, hinge_count apart. Their energies are added up at
/// `partial`: of bending, and then of damping where there are angles at the start.
template <typename Places>
__device__ void hinge_gradients(const SheetTables& tables, const EnvironmentNumbers& environment,
                                const double* start_angles, const Places& place, double* shares,
                                double* partial) {
  const int count = tables.hinge_count;
  add_up<2>(count, partial, [&](int e, double(&energies)[2]) {
    const HingeShape s = hinge_shape(tables, e, place);
    const double present = s.shares[0] * s.shares[1], rest_weight = tables.hinge_weights[e];
    Triple g[4] = {};
    if (present * rest_weight != 0) {
      const double angle = angle_of(s), bent = deviation(angle, tables.hinge_rest_angles[e]);
      double moment = environment.rigidity * bent,
             of_angle = 0.5 * rest_weight * environment.rigidity * bent * bent;
      energies[0] += present * of_angle;
      if (start_angles != nullptr) {
        const double turned = deviation(angle, start_angles[e]),
                     damping = environment.damping_share * environment.rigidity,
                     of_turn = 0.5 * rest_weight * damping * turned * turned;
        moment += damping * turned;
        energies[1] += present * of_turn;
        of_angle += of_turn;
      }
      angle_gradient(s, g);
      for (Triple& corner : g) corner = (present * rest_weight * moment) * corner;
      if (s.slopes[0] > 0) add_area_gradient(s, 0, 1, 2, of_angle * s.slopes[0] * s.shares[1], g);
      if (s.slopes[1] > 0) add_area_gradient(s, 1, 0, 3, of_angle * s.shares[0] * s.slopes[1], g);
    }
#pragma unroll
    for (int k = 0; k < 4; ++k) {
      double* to = shares + 3L * k * count + e;
      to[0] = g[k].x;
      to[count] = g[k].y;
      to[2 * count] = g[k].z;
    }
  });
}

/// What hinges give to a vertex.
__device__ inline Triple hinge_gradient_of(const SheetTables& tables, int vertex, const double* shares) {
  Triple sum = {0, 0, 0};
  for (int k = tables.hinge_corner_starts[vertex]; k < tables.hinge_corner_starts[vertex + 1]; ++k) {
    const int corner = tables.hinge_corners[k];
    const double* share = shares + 3L * (corner % 4) * tables.hinge_count + corner / 4;
    sum = sum + Triple{share[0], share[tables.hinge_count], share[2 * tables.hinge_count]};
  }
  return sum;
}

/// The matrices of all hinges, the sum of g g^T.
struct HingeMatrix {
  float* gradients = nullptr;  ///< g: twelve numbers a hinge; null without hinges
  float* products = nullptr;   ///< a number a hinge, for g^T x
};

template <typename Places>
__device__ void write_hinge_matrix(const SheetTables& tables, double rigidity, const Places& place,
                                   const HingeMatrix& matrix) {
  for (int e = team_rank(); e < tables.hinge_count; e += team_size()) {
    const HingeShape s = hinge_shape(tables, e, place);
    const double weight = rigidity * s.shares[0] * s.shares[1] * tables.hinge_weights[e], root = sqrt(weight);
    Triple g[4] = {};
    if (weight > 0) angle_gradient(s, g);
#pragma unroll
    for (int k = 0; k < 4; ++k) {
      float* to = matrix.gradients + 12L * e + 3 * k;
      to[0] = static_cast<float>(root * g[k].x);
      to[1] = static_cast<float>(root * g[k].y);
      to[2] = static_cast<float>(root * g[k].z);
    }
  }
}

/// g^T x of each hinge; the caller synchronizes.
__device__ inline void multiply_hinges(const SheetTables& tables, const HingeMatrix& matrix,
                                       const Four<float>* x) {
  for (int e = team_rank(); e < tables.hinge_count; e += team_size()) {
    const float* g = matrix.gradients + 12L * e;
    float sum = 0;
#pragma unroll
    for (int k = 0; k < 4; ++k) {
      const Four<float> from = x[tables.hinge_vertices[k * tables.hinge_count + e]];
      sum += g[3 * k] * from.x + g[3 * k + 1] * from.y + g[3 * k + 2] * from.z;
    }
    matrix.products[e] = sum;
  }
}

/// The hinges' part of row i of a product.
__device__ inline float hinge_row(const SheetTables& tables, const HingeMatrix& matrix, int i) {
  const int vertex = i / 3, c = i - 3 * vertex;
  float sum = 0;
  for (int k = tables.hinge_corner_starts[vertex]; k < tables.hinge_corner_starts[vertex + 1]; ++k) {
    const int corner = tables.hinge_corners[k];
    sum += matrix.gradients[3L * corner + c] * matrix.products[corner / 4];
  }
  return sum;
}

}  // namespace flash::sim::cuda
