#pragma once
#include "sim/cuda/front_panel.cuh"
#include "sim/cuda/tensor_core.cuh"

namespace flash::sim::cuda {

// The inverse X of the Cholesky factor L of a front's own block A11, in place: at the end X^T stands on and
// above the diagonal of the panel's own rows. Gauss and Jordan's elimination of [A11 I], block of
// `panel_width` columns after block: what turns A11 into L^T turns I into X. A column of blocks k has L below
// its diagonal and X^T above it, and both take the same steps: times X_kk^T, then off the columns behind.

/// The diagonal block at `first`, by one warp: X_kk^T, zeros below its diagonal. Returns false at a pivot
/// that is not positive, in whose place stands 1.
__device__ inline bool invert_diagonal_block(const Panel& panel, int first) {
  constexpr unsigned all = 0xffffffffu;
  // Eight lanes have a column of the block each, the next eight one of the identity.
  const int column = lane() % panel_width;
  const bool right = lane() & panel_width;
  float numbers[panel_width];
  bool positive = true;
#pragma unroll
  for (int i = 0; i < panel_width; ++i) {
    numbers[i] = panel.at(first + max(i, column), first + min(i, column));
    if (right) numbers[i] = i == column ? 1.0f : 0.0f;
  }
#pragma unroll
  for (int k = 0; k < panel_width; ++k) {
    float pivot = __shfl_sync(all, numbers[k], k);
    if (!(pivot > 0)) {
      positive = false;
      pivot = 1;
    }
    const float scale = rsqrtf(pivot);
    numbers[k] *= scale;
#pragma unroll
    for (int i = k + 1; i < panel_width; ++i)
      numbers[i] -= __shfl_sync(all, numbers[i], k) * scale * numbers[k];
  }
  __syncwarp();
  if (lane() >= panel_width && lane() < 2 * panel_width)
#pragma unroll
    for (int i = 0; i < panel_width; ++i) panel.at(first + column, first + i) = numbers[i];
  __syncwarp();
  return positive;
}

/// Rows from `row` on, 16 of them, in the columns from `column` on.
__device__ inline LeftFragment left_fragment(const Panel& panel, int row, int column) {
  const int g = lane() / 4, t = lane() % 4;
  // Rows behind the last stand for it: nothing is made of them.
  const int upper = row + g, lower = min(upper + 8, panel.height() - 1);
  LeftFragment fragment;
#pragma unroll
  for (int h = 0; h < 2; ++h) {
    fragment.set(2 * h, panel.at(upper, column + t + 4 * h));
    fragment.set(2 * h + 1, panel.at(lower, column + t + 4 * h));
  }
  return fragment;
}

/// The columns of blocks at `first` times X_kk^T, rows of the diagonal block apart.
__device__ inline void scale_columns(const Panel& panel, int first) {
  const int g = lane() / 4, t = lane() % 4, warps = panel.group.size / 32;
  RightFragment inverse;
#pragma unroll
  for (int h = 0; h < 2; ++h) inverse.set(h, panel.at(first + t + 4 * h, first + g));
  for (int row = 16 * (panel.group.rank / 32); row < panel.own; row += 16 * warps) {
    float sum[4] = {};
    add_product(sum, left_fragment(panel, row, first), inverse);
    __syncwarp();
#pragma unroll
    for (int i = 0; i < 2; ++i) {
      const int block = row + 8 * i;
      if (block == first || block >= panel.own) continue;
      panel.at(block + g, first + 2 * t) = sum[2 * i];
      panel.at(block + g, first + 2 * t + 1) = sum[2 * i + 1];
    }
  }
}

/// Takes the columns of blocks at `first` off 16 rows of a column of blocks behind: L from the row `lower`
/// on, X^T up to the block at `first`.
__device__ inline void take_off(const Panel& panel, int first, int row, int column, int lower) {
  const int g = lane() / 4, t = lane() % 4;
  RightFragment right;
#pragma unroll
  for (int h = 0; h < 2; ++h) right.set(h, panel.at(column + g, first + t + 4 * h));
  float sum[4] = {};
  add_product(sum, left_fragment(panel, row, first), right);
#pragma unroll
  for (int i = 0; i < 2; ++i) {
    const int block = row + 8 * i;
    if (block > first && (block < lower || block >= panel.own)) continue;
    float* to = &panel.at(block + g, column + 2 * t);
    to[0] -= sum[2 * i];
    to[panel.leading] -= sum[2 * i + 1];
  }
}

/// The same for all columns behind. The first warp goes ahead to the next diagonal block and inverts it,
/// which nothing else can hide. Returns, to that warp, whether its pivots were positive.
__device__ inline bool take_off_all(const Panel& panel, int first) {
  const int next = first + panel_width, own_warp = panel.group.rank / 32, warps = panel.group.size / 32;
  bool positive = true;
  if (own_warp == 0) {
    take_off(panel, first, next, next, next);
    __syncwarp();
    positive = invert_diagonal_block(panel, next);
    if (warps > 1) return positive;
  }
  // Tiles of 16 rows, without those that the first warp has.
  const int height = rounded_up(panel.own, 16), step = 16 * (warps > 1 ? warps - 1 : 1);
  int row = warps > 1 ? 16 * (own_warp - 1) : 0;
  for (int column = next;; row += step) {
    for (; row >= height; row -= height) column += panel_width;
    if (column >= panel.own) return positive;
    const int lower = column == next ? next + 16 : column;
    if (row > first && row + 8 < lower) continue;
    take_off(panel, first, row, column, lower);
  }
}

/// Returns, to the first warp at least, whether all pivots were positive.
__device__ inline bool invert_own_block(const Panel& panel) {
  bool positive = true;
  if (panel.group.rank < 32) positive = invert_diagonal_block(panel, 0);
  for (int first = 0;; first += panel_width) {
    panel.group.synchronize();
    scale_columns(panel, first);
    panel.group.synchronize();
    if (first + panel_width == panel.own) return positive;
    positive = take_off_all(panel, first) && positive;
  }
}

}  // namespace flash::sim::cuda
