#pragma once
#include "sim/cuda/front_tables.h"
#include "sim/cuda/stored.cuh"
#include "sim/cuda/team.cuh"

namespace flash::sim::cuda {

// Solves with the factor of front_factor.cuh. A front's columns W = [L11^-1; -L21 L11^-1] serve both ways:
// forward its own numbers b become [y; u] = W b, u passed up; backward x = W^T [y; x_below]. So the operator
// is F^T F whatever the rounding of W: symmetric and positive definite, as conjugate gradients need it. One
// barrier a level each way; the factor is read twice.

/// On-chip numbers that a solve needs.
__host__ __device__ inline int solve_memory(int largest_columns) {
  return team_warps * ((largest_columns + 3) / 4 * 4);
}

/// Three numbers a vertex of one environment: what a solve works on, in any memory.
struct SolveVectors {
  float* forward;  ///< 6 a vertex: y of the forward solve, then right-hand side and solution
  float* passed;   ///< FrontTables::vector_size
};

/// What the children of a front pass up to its entry `row`, in numbers of the front without padding.
__device__ inline float passed_up(const FrontTables& tables, const FrontLayout& front, int row,
                                  const float* passed) {
  const int vertices = front.column_count + front.row_count, vertex = row / 3, coordinate = row - 3 * vertex;
  float sum = 0;
#pragma unroll
  for (int k = 0; k < 2; ++k) {
    if (front.children[k] < 0) continue;
    const int place = tables.child_rows[front.first_map + k * vertices + vertex];
    if (place >= 0) sum += passed[tables.fronts[front.children[k]].vector_at + 3 * place + coordinate];
  }
  return sum;
}

/// Lanes take four rows each, over every eighth column.
template <typename Stored>
__device__ void run_forward(const FrontTables& tables, const ForwardTask& task, const Stored* factor,
                            const SolveVectors& v, float* own) {
  const FrontLayout& front = tables.fronts[task.front];
  const int columns = 3 * front.column_count, quad = lane() % 4, first_column = lane() / 4;
  const float* right = v.forward + 3 * tables.size + 3 * front.first_column;
  for (int k = lane(); k < columns; k += 32) own[k] = right[k] + passed_up(tables, front, k, v.passed);
  __syncwarp();
  const Stored* panel = factor + front.panel_at;
  for (int row = task.first_row; row < task.end_row; row += forward_rows) {
    const int first = row + 4 * quad;
    // Above the diagonal there are zeros.
    const int end = min(columns, row + forward_rows);
    const int end_column = row + forward_rows > front.below_at ? columns : end;
    float4 sum = {0, 0, 0, 0};
#pragma unroll 4
    for (int k = first_column; k < end_column; k += 8) {
      const float4 w = load_four(panel + static_cast<long>(k) * front.leading + first);
      const float x = own[k];
      sum.x += w.x * x;
      sum.y += w.y * x;
      sum.z += w.z * x;
      sum.w += w.w * x;
    }
#pragma unroll
    for (int offset = 4; offset < 32; offset *= 2) {
      sum.x += __shfl_xor_sync(0xffffffffu, sum.x, offset);
      sum.y += __shfl_xor_sync(0xffffffffu, sum.y, offset);
      sum.z += __shfl_xor_sync(0xffffffffu, sum.z, offset);
      sum.w += __shfl_xor_sync(0xffffffffu, sum.w, offset);
    }
    if (first_column >= 4) continue;
    // Each of four lanes keeps one row.
    const float result = first_column == 0   ? sum.x
                         : first_column == 1 ? sum.y
                         : first_column == 2 ? sum.z
                                             : sum.w;
    const int mine = first + first_column, below = mine - front.below_at;
    if (mine < columns)
      v.forward[3 * front.first_column + mine] = result;
    else if (below >= 0 && below < 3 * front.row_count)
      v.passed[front.vector_at + below] = result + passed_up(tables, front, columns + below, v.passed);
  }
  __syncwarp();
}

/// Lanes take four rows each, over all of the task's columns.
template <typename Stored>
__device__ void run_backward(const FrontTables& tables, const BackwardTask& task, const Stored* factor,
                             const SolveVectors& v) {
  const FrontLayout& front = tables.fronts[task.front];
  const int columns = min(backward_columns, 3 * front.column_count - task.first_column);
  const Stored* panel = factor + front.panel_at + static_cast<long>(task.first_column) * front.leading;
  float sums[backward_columns] = {};
  for (int row = task.first_column / 4 * 4 + 4 * lane(); row < front.leading; row += 128) {
    const int4 entry = *reinterpret_cast<const int4*>(tables.entries + front.first_entry + row);
    const float4 x = {v.forward[entry.x], v.forward[entry.y], v.forward[entry.z], v.forward[entry.w]};
#pragma unroll
    for (int c = 0; c < backward_columns; ++c) {
      if (c >= columns) continue;
      const float4 w = load_four(panel + static_cast<long>(c) * front.leading + row);
      sums[c] += (w.x * x.x + w.y * x.y) + (w.z * x.z + w.w * x.w);
    }
  }
  // Halves of the lanes take halves of the columns, until each has one; then the rest adds up.
#pragma unroll
  for (int kept = backward_columns / 2, bit = 16; kept > 0; kept /= 2, bit /= 2) {
    const bool upper = lane() & bit;
#pragma unroll
    for (int c = 0; c < kept; ++c) {
      const float given = upper ? sums[c] : sums[c + kept], own = upper ? sums[c + kept] : sums[c];
      sums[c] = own + __shfl_xor_sync(0xffffffffu, given, bit);
    }
  }
  sums[0] += __shfl_xor_sync(0xffffffffu, sums[0], 2);
  sums[0] += __shfl_xor_sync(0xffffffffu, sums[0], 1);
  const int column = lane() / 4;
  if (lane() % 4 == 0 && column < columns)
    v.forward[3 * (tables.size + front.first_column) + task.first_column + column] = sums[0];
}

/// x <- (L L^T)^-1 x, x behind the first 3 a vertex of `forward`. `own`: solve_memory on chip.
template <typename Stored>
__device__ void solve(const FrontTables& tables, const Stored* factor, const SolveVectors& v, float* own) {
  float* mine = own + warp() * ((tables.largest_columns + 3) / 4 * 4);
  for (int l = 0; l < tables.level_count; ++l) {
    __syncthreads();
    const FrontLevel level = tables.levels[l];
    for (int t = warp(); t < level.forward_count; t += team_warps)
      run_forward(tables, tables.forward[level.first_forward + t], factor, v, mine);
  }
  for (int l = tables.level_count; l-- > 0;) {
    __syncthreads();
    const FrontLevel level = tables.levels[l];
    for (int t = warp(); t < level.backward_count; t += team_warps)
      run_backward(tables, tables.backward[level.first_backward + t], factor, v);
  }
  __syncthreads();
}

}  // namespace flash::sim::cuda
