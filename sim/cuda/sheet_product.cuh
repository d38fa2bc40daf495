#pragma once
#include <type_traits>

#include "sim/cuda/four.h"
#include "sim/cuda/hinges.cuh"
#include "sim/cuda/layout/edge_sources.h"
#include "sim/cuda/sheet_tables.h"
#include "sim/cuda/team_sum.cuh"

namespace flash::sim::cuda {

/// The four numbers that a lane has of a step.
__device__ inline Four<float> step_values_at(const float* values, int step) {
  return reinterpret_cast<const Four<float>*>(values)[32L * step + lane()];
}
__device__ inline Four<double> step_values_at(const double* values, int step) {
  const double2* of_step = reinterpret_cast<const double2*>(values) + 64L * step;
  const double2 first = of_step[lane()], second = of_step[32 + lane()];
  return {first.x, first.y, second.x, second.y};
}

/// What a lane has of a few steps that follow each other.
template <typename Number>
struct StepNumbers {
  /// As many of either precision as leave room for those of the next steps in registers.
  static constexpr int together = std::is_same_v<Number, float> ? steps_together : steps_together / 2;

  Four<Number> rows[together];
  int columns[together];

  __device__ StepNumbers(const SheetTables& tables, const Number* values, int first) {
#pragma unroll
    for (int k = 0; k < together; ++k) rows[k] = step_values_at(values, first + k);
#pragma unroll
    for (int k = 0; k < together; ++k) columns[k] = tables.step_columns[32 * (first + k) + lane()];
  }
};

/// S x over the vertices: x(vertex) has x, y and z, and write(row, c, number) takes coordinate c of a row. S,
/// shared by all environments, comes from the second-level cache; four lanes share the columns of a group of
/// four rows.
template <typename Number, typename Places, typename Write>
__device__ void multiply_scalar_rows(const SheetTables& tables, const Number* values, const Places& x,
                                     const Write& write) {
  static_assert(4 * bundle_groups == 32);
  for (int i = team_rank(); i < 3 * tables.size && tables.bundle_count == 0; i += team_size())
    write(i / 3, i % 3, Number{});
  for (int bundle = team_warp(); bundle < tables.bundle_count; bundle += team_warps()) {
    const int start = tables.bundle_starts[bundle], end = tables.bundle_starts[bundle + 1];
    Number sums[4][3] = {};
    StepNumbers<Number> now(tables, values, start);
    for (int step = start; step < end; step += now.together) {
      // Those of the next steps are on their way meanwhile; behind the last ones they are not used.
      const StepNumbers<Number> next(tables, values, min(step + now.together, end - now.together));
#pragma unroll
      for (int k = 0; k < now.together; ++k) {
        const auto vertex = x(now.columns[k]);
        const Four<Number> own = now.rows[k];
        const Number rows[4] = {own.x, own.y, own.z, own.w};
#pragma unroll
        for (int row = 0; row < 4; ++row) {
          sums[row][0] += rows[row] * vertex.x;
          sums[row][1] += rows[row] * vertex.y;
          sums[row][2] += rows[row] * vertex.z;
        }
      }
      now = next;
    }
    Number own[3] = {};
#pragma unroll
    for (int row = 0; row < 4; ++row)
#pragma unroll
      for (int c = 0; c < 3; ++c) {
        Number sum = sums[row][c];
        sum += __shfl_xor_sync(0xffffffffu, sum, 1);
        sum += __shfl_xor_sync(0xffffffffu, sum, 2);
        if (row == lane() % 4) own[c] = sum;
      }
    const int row = tables.group_rows[32 * bundle + lane()];
    if (row >= 0)
      for (int c = 0; c < 3; ++c) write(row, c, own[c]);
  }
}

/// y += B x, B the block rows of one environment: a thread a scalar row. Returns x.y, to all threads.
/// `partial`: as sum_over_team wants it.
inline __device__ float add_block_rows(const SheetTables& tables, const float* blocks,
                                       const HingeMatrix& hinges, const Four<float>* x, float* y,
                                       float* partial) {
  // The blocks of most rows are no more than this, and are on their way together.
  constexpr int together = 8;
  float product[1];
  sum_over_team(3 * tables.size, product, partial, [&](int i, float(&sums)[1]) {
    const int slice = i / (3 * slice_size), row = i - slice * 3 * slice_size, vertex = row / 3;
    const int start = tables.slice_starts[slice], end = tables.slice_starts[slice + 1];
    float sum = y[i];
    for (int first = start; first < end; first += together) {
      int columns[together];
      float numbers[together][3];
#pragma unroll
      for (int k = 0; k < together; ++k) {
        const bool there = first + k < end;
        const float* column = blocks + static_cast<long>(first + k) * slice_numbers + row;
        columns[k] = there ? tables.slice_columns[(first + k) * slice_size + vertex] : 0;
#pragma unroll
        for (int c = 0; c < 3; ++c) numbers[k][c] = there ? column[3 * slice_size * c] : 0.0f;
      }
#pragma unroll
      for (int k = 0; k < together; ++k) {
        const Four<float> from = x[columns[k]];
        sum += numbers[k][0] * from.x + numbers[k][1] * from.y + numbers[k][2] * from.z;
      }
    }
    if (hinges.gradients != nullptr) sum += hinge_row(tables, hinges, i);
    y[i] = sum;
    sums[0] += sum * reinterpret_cast<const float*>(x)[i / 3 * 4 + i % 3];
  });
  return product[0];
}

/// y = (B + scale S + hinges) x, x four numbers a vertex. The caller has synchronized x; y is of the calling
/// threads' own rows. Returns x.y, to all threads, behind a barrier. `partial`: as sum_over_team wants it.
inline __device__ float multiply(const SheetTables& tables, const float* blocks, float scale,
                                 const HingeMatrix& hinges, const Four<float>* x, float* y, float* partial) {
  if (hinges.gradients != nullptr) multiply_hinges(tables, hinges, x);
  multiply_scalar_rows(
      tables, tables.single_step_values, [&](int vertex) { return x[vertex]; },
      [&](int row, int c, float sum) { y[3 * row + c] = scale * sum; });
  return add_block_rows(tables, blocks, hinges, x, y, partial);
}

}  // namespace flash::sim::cuda
