#pragma once
#include "sim/cuda/four.h"
#include "sim/cuda/hinges.cuh"
#include "sim/cuda/layout/edge_sources.h"
#include "sim/cuda/scalar_rows.cuh"
#include "sim/cuda/sheet_tables.h"
#include "sim/cuda/team_sum.cuh"

namespace flash::sim::cuda {

/// y += B x, B the block rows of one environment: a thread a scalar row. Returns x.y, to all threads.
/// `partial`: as sum_over_team wants it.
inline __device__ float add_block_rows(const SheetTables& tables, const float* blocks,
                                       const HingeMatrix& hinges, const Four<float>* x, float* y,
                                       float* partial) {
  // The blocks of most rows are no more than this, and are on their way together.
  constexpr int together = 9;
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
/// threads' own rows. Returns x.y, to all threads, behind a barrier. `steps`: those of S. `partial`: as
/// sum_over_team wants it.
inline __device__ float multiply(const SheetTables& tables, const float* blocks, float scale,
                                 const HingeMatrix& hinges, StepsOnTheirWay<float>& steps,
                                 const Four<float>* x, float* y, float* partial) {
  if (hinges.gradients != nullptr) multiply_hinges(tables, hinges, x);
  const auto place = [&](int vertex) { return x[vertex]; };
  const auto write = [&](int row, int c, float sum) { y[3 * row + c] = scale * sum; };
  multiply_scalar_rows(tables, tables.single_step_values, steps, place, write);
  return add_block_rows(tables, blocks, hinges, x, y, partial);
}

}  // namespace flash::sim::cuda
