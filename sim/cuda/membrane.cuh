#pragma once
#include "sim/cuda/environment_numbers.h"
#include "sim/cuda/sheet_product.cuh"
#include "sim/law/membrane_response.h"

namespace flash::sim::cuda {

// Energy, gradient and Hessian of the membrane in double precision, by the formulas of
// sim/law/membrane_response.h. A thread takes a triangle and writes what it gives to memory of its own; then
// a thread takes a vertex, or an entry of a block, and adds up its triangles in a fixed order.

using Triple = Vector3<double>;

__device__ inline Triple triple(const Point& p) { return {p.x, p.y, p.z}; }

struct TriangleFrame {
  SingularFrame<double> frame;
  double w10, w11, w20, w21, area;
};

__device__ inline TriangleFrame triangle_frame(const SheetTables& tables, int t, const Point* positions) {
  const int count = tables.triangle_count;
  const Triple x0 = triple(positions[tables.triangle_vertices[t]]);
  const Triple e1 = triple(positions[tables.triangle_vertices[count + t]]) - x0,
               e2 = triple(positions[tables.triangle_vertices[2 * count + t]]) - x0;
  TriangleFrame f;
  f.w10 = tables.gradients[t];
  f.w11 = tables.gradients[count + t];
  f.w20 = tables.gradients[2 * count + t];
  f.w21 = tables.gradients[3 * count + t];
  f.area = tables.areas[t];
  f.frame = singular_frame(f.w10 * e1 + f.w20 * e2, f.w11 * e1 + f.w21 * e2);
  return f;
}

__device__ inline PrincipalResponse<double> response_at(const EnvironmentNumbers& environment, double s1,
                                                        double s2) {
  switch (environment.law) {
    case MembraneLaw::saint_venant_kirchhoff:
      return SaintVenantKirchhoff::at(s1, s2, environment.lame.mu, environment.lame.lambda);
    case MembraneLaw::neo_hookean:
      return NeoHookean::at(s1, s2, environment.lame.mu, environment.lame.lambda);
    case MembraneLaw::corotated:
      break;
  }
  return Corotated::at(s1, s2, environment.lame.mu, environment.lame.lambda);
}

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

/// A block, column after column.
struct Block {
  Triple columns[3];
};
__device__ inline Block operator+(const Block& a, const Block& b) {
  return {{a.columns[0] + b.columns[0], a.columns[1] + b.columns[1], a.columns[2] + b.columns[2]}};
}
__device__ inline Block negative(const Block& a) {
  return {{-1.0 * a.columns[0], -1.0 * a.columns[1], -1.0 * a.columns[2]}};
}
__device__ inline Block transposed(const Block& a) {
  const Triple* c = a.columns;
  return {{{c[0].x, c[1].x, c[2].x}, {c[0].y, c[1].y, c[2].y}, {c[0].z, c[1].z, c[2].z}}};
}

/// Writes the blocks of a warp's triangles one after the other, through nine numbers a lane on chip. Lanes
/// from `count` on have none.
__device__ inline void write_blocks(const Block& block, int count, float* to, float* chip) {
#pragma unroll
  for (int c = 0; c < 3; ++c) {
    chip[9 * lane() + 3 * c] = static_cast<float>(block.columns[c].x);
    chip[9 * lane() + 3 * c + 1] = static_cast<float>(block.columns[c].y);
    chip[9 * lane() + 3 * c + 2] = static_cast<float>(block.columns[c].z);
  }
  __syncwarp();
  for (int i = lane(); i < 9 * count; i += 32) to[i] = chip[i];
  __syncwarp();
}

/// The triangles' blocks of the membrane's Hessian, six times triangle_count, nine numbers each. `positive`:
/// without negative eigenvalues. `chip`: 288 numbers a warp.
inline __device__ void triangle_blocks(const SheetTables& tables, const EnvironmentNumbers& environment,
                                       const Point* positions, bool positive, float* shares, float* chip) {
  const int count = tables.triangle_count;
  float* own_chip = chip + 9 * 32 * warp();
  for (int first = 32 * warp(); first < count; first += team_threads) {
    const int t = min(first + lane(), count - 1), there = min(32, count - first);
    const TriangleFrame f = triangle_frame(tables, t, positions);
    PrincipalResponse<double> response = response_at(environment, f.frame.s1, f.frame.s2);
    if (positive) clamp(response);
    const HessianBlocks<double> H = hessian_of(f.frame, response);
    // sum_cd w_ic w_jd H_cd, where H_10 = H_01^T.
    const Block turned = transposed({{H.h01[0], H.h01[1], H.h01[2]}});
    const auto block = [&](double i0, double i1, double j0, double j1) {
      Block sum;
#pragma unroll
      for (int c = 0; c < 3; ++c)
        sum.columns[c] = (f.area * i0 * j0) * H.h00[c] + (f.area * i0 * j1) * H.h01[c] +
                         (f.area * i1 * j0) * turned.columns[c] + (f.area * i1 * j1) * H.h11[c];
      return sum;
    };
    const auto write = [&](int k, const Block& b) {
      write_blocks(b, there, shares + 9 * (static_cast<long>(k) * count + first), own_chip);
    };
    // Rows and columns of a triangle sum to zero.
    const Block b11 = block(f.w10, f.w11, f.w10, f.w11), b22 = block(f.w20, f.w21, f.w20, f.w21),
                b21 = block(f.w20, f.w21, f.w10, f.w11);
    const Block b10 = negative(b11 + transposed(b21)), b20 = negative(b21 + b22);
    write(0, negative(b10 + b20));
    write(1, b11);
    write(2, b22);
    write(3, b10);
    write(4, b20);
    write(5, b21);
  }
}

/// The sum of what the triangles give to number e of a block.
__device__ inline float sum_of_shares(const SheetTables& tables, const BlockSources& block, int e,
                                      const float* __restrict__ shares) {
  constexpr int together = 4;  // reads under way
  float sum = 0;
  for (int first = 0; first < block.source_count; first += together) {
    float numbers[together];
#pragma unroll
    for (int k = 0; k < together; ++k) {
      const int source = block.first_source + min(first + k, block.source_count - 1);
      numbers[k] = shares[9L * tables.block_sources[source] + e];
    }
#pragma unroll
    for (int k = 0; k < together; ++k)
      if (first + k < block.source_count) sum += numbers[k];
  }
  return sum;
}

/// Mass over h^2 of the vertex of a diagonal block.
__device__ inline float inertia(const SheetTables& tables, const EnvironmentNumbers& environment, int block) {
  return static_cast<float>(environment.inertia_density * tables.vertex_area[tables.block_vertex[block]]);
}

/// The Hessian of membrane and inertia as block rows (sheet_product.cuh). Hinges apart, these are all blocks.
inline __device__ void assemble_block_rows(const SheetTables& tables, const EnvironmentNumbers& environment,
                                           const float* shares, float* rows) {
  for (int i = static_cast<int>(threadIdx.x); i < 9 * tables.block_count; i += team_threads) {
    const int b = i / 9, e = i - 9 * b, c = e / 3, r = e - 3 * c;
    const BlockSources block = tables.blocks[b];
    if (block.place < 0) continue;
    float sum = sum_of_shares(tables, block, e, shares);
    if (c == r && tables.block_vertex[b] >= 0) sum += inertia(tables, environment, b);
    rows[block.place + 3 * slice_size * c + r] = sum;
    if (block.turned_place >= 0) rows[block.turned_place + 3 * slice_size * r + c] = sum;
  }
}

/// The same with the stand-in for bending, as blocks of the pattern: what is factorized.
inline __device__ void assemble_blocks(const SheetTables& tables, const EnvironmentNumbers& environment,
                                       const float* shares, float* blocks) {
  for (int i = static_cast<int>(threadIdx.x); i < 9 * tables.block_count; i += team_threads) {
    const int b = i / 9, e = i - 9 * b;
    float sum = sum_of_shares(tables, tables.blocks[b], e, shares);
    if (e % 4 == 0) {
      if (tables.stand_in != nullptr) sum += static_cast<float>(environment.rigidity) * tables.stand_in[b];
      if (tables.block_vertex[b] >= 0) sum += inertia(tables, environment, b);
    }
    blocks[i] = sum;
  }
}

}  // namespace flash::sim::cuda
