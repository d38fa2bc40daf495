#pragma once
#include "sim/cuda/front_panel.cuh"
#include "sim/cuda/solve_tile.cuh"
#include "sim/cuda/tensor_core.cuh"

namespace flash::sim::cuda {

// What follows from A21 and X = L11^-1, by tiles of 32 rows, a warp each: L21 = A21 X^T in place, the
// factor's -L21 X, and the update matrix, less L21 L21^T. Products are without branches: columns behind the
// last stand for it, and nothing is made of them.

/// Columns of a tile of L21, in blocks of eight, and of the update matrix.
inline constexpr int strip_blocks = 3, strip_columns = 8 * strip_blocks, tile_size = 32;

/// Numbers on chip that a warp passes a tile through.
inline constexpr int tile_numbers = tile_size * tile_size;

/// Four rows of a column of such a tile: columns next to each other begin in different banks.
__device__ inline int tile_place(int column, int four_rows) {
  return tile_size * column + 4 * (four_rows ^ (column % 8));
}

/// The rows of a lane from those below from `row` on; those behind the last stand for it.
__device__ inline int clamped_rows(const Panel& panel, int row) {
  return panel.own + min(row + lane() / 4 * 4, (panel.below + 3) / 4 * 4 - 4);
}

/// Eight columns of the rows from `row` on.
__device__ inline LeftTile left_tile(const Panel& panel, int row, int column) {
  const float* from = &panel.at(row, column + lane() % 4);
  return {four_at(from), four_at(from + 4 * panel.leading)};
}

/// A strip of 32 rows of A21, in place, the last columns first: they need all others.
__device__ inline void make_strip(const Panel& panel, int strip) {
  const int g = lane() / 4, t = lane() % 4, row = clamped_rows(panel, 32 * strip);
  for (int first = (panel.own - 1) / strip_columns * strip_columns; first >= 0; first -= strip_columns) {
    TileProduct products[strip_blocks];
    const float* across[strip_blocks];  // a column of X^T
#pragma unroll
    for (int b = 0; b < strip_blocks; ++b) across[b] = &panel.at(t, min(first + 8 * b, panel.own - 8) + g);
#pragma unroll 1
    for (int k = 0; k < first; k += 8) {
      const LeftTile left = left_tile(panel, row, k);
#pragma unroll
      for (int b = 0; b < strip_blocks; ++b) products[b].add(left, across[b][k], across[b][k + 4]);
    }
    // Below the diagonal X^T is zero.
#pragma unroll
    for (int d = 0; d < strip_blocks; ++d) {
      const int k = first + 8 * d;
      if (k >= panel.own) break;
      const LeftTile left = left_tile(panel, row, k);
#pragma unroll
      for (int b = d; b < strip_blocks; ++b) products[b].add(left, across[b][k], across[b][k + 4]);
    }
    __syncwarp();
#pragma unroll
    for (int b = 0; b < strip_blocks; ++b)
      if (32 * strip + 4 * g < panel.below && first + 8 * b < panel.own)
#pragma unroll
        for (int j = 0; j < 2; ++j) panel.set_four(row, first + 8 * b + 2 * t + j, products[b].rows(j));
    __syncwarp();
  }
}

/// A strip of -L21 X to the factor.
template <int parts>
__device__ void store_strip(const FrontLayout& front, const Panel& panel, int strip,
                            const FactorColumns<parts>& factor) {
  const int g = lane() / 4, t = lane() % 4, row = clamped_rows(panel, 32 * strip);
  const int first_row = 32 * strip + 4 * g, step = 4 * panel.leading;
  __half* to = kept_whole(factor.row(front.below_at + first_row));
  for (int first = 0; first < panel.columns; first += strip_columns) {
    TileProduct products[strip_blocks];
    const float* across[strip_blocks];  // a row of X^T
#pragma unroll
    for (int b = 0; b < strip_blocks; ++b) across[b] = &panel.at(min(first + 8 * b, panel.own - 8) + g, t);
#pragma unroll
    for (int d = 0; d < strip_blocks; ++d) {
      const int k = first + 8 * d;
      if (k >= panel.own) break;
      const LeftTile left = left_tile(panel, row, k);
#pragma unroll
      for (int b = 0; b <= d; ++b) {
        const float* from = across[b] + k * panel.leading;
        products[b].add(left, from[0], from[step]);
      }
    }
#pragma unroll 1
    for (int k = first + strip_columns; k < panel.own; k += 8) {
      const LeftTile left = left_tile(panel, row, k);
#pragma unroll
      for (int b = 0; b < strip_blocks; ++b) {
        const float* from = across[b] + k * panel.leading;
        products[b].add(left, from[0], from[step]);
      }
    }
#pragma unroll
    for (int b = 0; b < strip_blocks; ++b) {
      const int column = first + 8 * b + 2 * t;
      if (column >= panel.columns) continue;
      const bool both = column + 1 < panel.columns;
      const float4 near = products[b].rows(0), far = products[b].rows(1);
      const float numbers[4][2] = {{near.x, far.x}, {near.y, far.y}, {near.z, far.z}, {near.w, far.w}};
      __half* at = to + FactorColumns<parts>::column(first + 8 * b) + 2 * t;
#pragma unroll
      for (int i = 0; i < 4; ++i)
        if (first_row + i < panel.below)
          store_two<parts>(-numbers[i][0], both ? -numbers[i][1] : 0.0f, at + i * solve_tile_row);
    }
  }
}

/// X to the factor, squares of eight on and below its diagonal. Above them stands nothing but zeros.
template <int parts>
__device__ void store_inverse(const Panel& panel, const FactorColumns<parts>& factor) {
  const int g = lane() / 4, t = lane() % 4, warps = panel.group.size / 32;
  int row = 0, column = panel.group.rank / 32;
  while (true) {
    for (; column > row; ++row) column -= row + 1;
    if (8 * row >= panel.columns) return;
    const int r = 8 * row + g, c = 8 * column + 2 * t;
    if (r < panel.columns)
      store_two<parts>(r >= c ? panel.at(c, r) : 0.0f, r > c ? panel.at(c + 1, r) : 0.0f,
                       factor.row(r) + FactorColumns<parts>::column(c));
    column += warps;
  }
}

/// What the children pass up to a tile, on chip; a row each lane, so that what lies together is read
/// together.
__device__ inline void gather_tile(const Panel& panel, const ChildRows& rows, int row, int column,
                                   const float* updates, float* chip) {
  const int own = row + lane(), at = panel.own + own;
  const int four_rows = lane() / 4, rest = lane() % 4;
  float numbers[2][tile_size];
#pragma unroll
  for (int k = 0; k < 2; ++k)
    rows.gather(updates, k, own < panel.below ? rows.place(k, at) : -1, panel.own + column, numbers[k]);
#pragma unroll
  for (int j = 0; j < tile_size; ++j) chip[tile_place(j, four_rows) + rest] = numbers[0][j] + numbers[1][j];
}

/// A tile of what the front passes up. `chip`: tile_numbers of the warp.
__device__ inline void make_update_tile(const FrontLayout& front, const Panel& panel, const ChildRows& rows,
                                        int row, int column, float* updates, float* chip) {
  constexpr int blocks = tile_size / 8;
  const int g = lane() / 4, t = lane() % 4;
  if (rows.any) gather_tile(panel, rows, row, column, updates, chip);
  TileProduct products[blocks];
  const float* left = &panel.at(clamped_rows(panel, row), t);
  const float* right[blocks];
#pragma unroll
  for (int b = 0; b < blocks; ++b)
    right[b] = &panel.at(panel.own + min(column + 8 * b + g, panel.below - 1), t);
  const int step = 4 * panel.leading;
#pragma unroll 1
  for (int k = 0; k < panel.own; k += 8) {
    const LeftTile rows_of_tile(four_at(left), four_at(left + step));
    left += 2 * step;
#pragma unroll
    for (int b = 0; b < blocks; ++b, right[b - 1] += 2 * step)
      products[b].add(rows_of_tile, right[b][0], right[b][step]);
  }
  __syncwarp();
  const int first = row + 4 * g;
  float* update = kept_whole(updates + front.update_at + first);
#pragma unroll
  for (int b = 0; b < blocks; ++b)
#pragma unroll
    for (int j = 0; j < 2; ++j) {
      const int in_tile = 8 * b + 2 * t + j, to = column + in_tile;
      float4 sum = {0, 0, 0, 0};
      if (rows.any) sum = four_at(chip + tile_place(in_tile, g));
      const float4 taken = products[b].rows(j);
      sum = {sum.x - taken.x, sum.y - taken.y, sum.z - taken.z, sum.w - taken.w};
      if (first < panel.below && to < panel.below)
        *reinterpret_cast<float4*>(update + to * front.update_leading) = sum;
    }
  __syncwarp();
}

/// What the front passes up: what its children do, less L21 L21^T, by tiles of the lower triangle. Above the
/// diagonal stands anything.
__device__ inline void make_update(const FrontLayout& front, const Panel& panel, const ChildRows& rows,
                                   float* updates, float* chip) {
  const int warps = panel.group.size / 32;
  int row = 0, column = panel.group.rank / 32;
  while (true) {
    // A strip has the tiles up to its diagonal.
    for (; column > row; ++row) column -= row + 1;
    if (tile_size * row >= panel.below) return;
    make_update_tile(front, panel, rows, tile_size * row, tile_size * column, updates, chip);
    column += warps;
  }
}

}  // namespace flash::sim::cuda
