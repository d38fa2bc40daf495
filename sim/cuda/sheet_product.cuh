#pragma once
#include "sim/cuda/four.h"
#include "sim/cuda/hinges.cuh"
#include "sim/cuda/sheet_tables.h"
#include "sim/cuda/team.cuh"

namespace flash::sim::cuda {

/// S x over the vertices: x(vertex) has x, y and z, and write(row, c, number) takes coordinate c of a row. S,
/// shared by all environments, comes from the second-level cache; four lanes share the columns of a group of
/// four rows.
template <typename Number, typename Places, typename Write>
__device__ void multiply_scalar_rows(const SheetTables& tables, const Number* values, const Places& x,
                                     const Write& write) {
  for (int i = static_cast<int>(threadIdx.x); i < 3 * tables.size && tables.group_count == 0;
       i += team_threads)
    write(i / 3, i % 3, Number{});
  const int part = lane() % 4;
  // Whole warps stay in the loop: their lanes exchange sums.
  for (int first = 8 * warp(); first < tables.group_count; first += 8 * team_warps) {
    const int wanted = first + lane() / 4, group = min(wanted, tables.group_count - 1);
    const int end = tables.group_starts[group + 1];
    Number sums[4][3] = {};
    for (int first_column = tables.group_starts[group] + part; first_column < end;
         first_column += group_padding) {
#pragma unroll
      for (int k = first_column; k < first_column + group_padding; k += 4) {
        const auto vertex = x(tables.group_columns[k]);
        const Four<Number> value = reinterpret_cast<const Four<Number>*>(values)[k];
        const Number rows[4] = {value.x, value.y, value.z, value.w};
#pragma unroll
        for (int row = 0; row < 4; ++row) {
          sums[row][0] += rows[row] * vertex.x;
          sums[row][1] += rows[row] * vertex.y;
          sums[row][2] += rows[row] * vertex.z;
        }
      }
    }
    Number own[3] = {};
#pragma unroll
    for (int row = 0; row < 4; ++row)
#pragma unroll
      for (int c = 0; c < 3; ++c) {
        Number sum = sums[row][c];
        sum += __shfl_xor_sync(0xffffffffu, sum, 1);
        sum += __shfl_xor_sync(0xffffffffu, sum, 2);
        if (row == part) own[c] = sum;
      }
    const int row = tables.group_rows[4 * group + part];
    if (row >= 0 && wanted < tables.group_count)
      for (int c = 0; c < 3; ++c) write(row, c, own[c]);
  }
}

/// y += B x, B the block rows of one environment: a thread a scalar row. Returns the thread's part of x.y.
inline __device__ float add_block_rows(const SheetTables& tables, const float* blocks,
                                       const HingeMatrix& hinges, const Four<float>* x, float* y) {
  float product = 0;
  for (int i = static_cast<int>(threadIdx.x); i < 3 * tables.size; i += team_threads) {
    const int slice = i / (3 * slice_size), row = i - slice * 3 * slice_size, vertex = row / 3;
    float sum = y[i];
#pragma unroll 4
    for (int k = tables.slice_starts[slice]; k < tables.slice_starts[slice + 1]; ++k) {
      const Four<float> from = x[tables.slice_columns[k * slice_size + vertex]];
      const float* column = blocks + static_cast<long>(k) * slice_numbers + row;
      sum += column[0] * from.x + column[3 * slice_size] * from.y + column[6 * slice_size] * from.z;
    }
    if (hinges.gradients != nullptr) sum += hinge_row(tables, hinges, i);
    y[i] = sum;
    product += sum * reinterpret_cast<const float*>(x)[i / 3 * 4 + i % 3];
  }
  return product;
}

/// y = (B + scale S + hinges) x, x four numbers a vertex. The caller has synchronized x; y is of the calling
/// threads' own rows i, i + team_threads, ... Returns the thread's part of x.y.
inline __device__ float multiply(const SheetTables& tables, const float* blocks, float scale,
                                 const HingeMatrix& hinges, const Four<float>* x, float* y) {
  if (hinges.gradients != nullptr) multiply_hinges(tables, hinges, x);
  multiply_scalar_rows(
      tables, tables.single_group_values, [&](int vertex) { return x[vertex]; },
      [&](int row, int c, float sum) { y[3 * row + c] = scale * sum; });
  __syncthreads();
  return add_block_rows(tables, blocks, hinges, x, y);
}

}  // namespace flash::sim::cuda
