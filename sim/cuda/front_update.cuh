#pragma once
#include "sim/cuda/front_panel.cuh"
#include "sim/cuda/stored.cuh"
#include "sim/cuda/tensor_core.cuh"

namespace flash::sim::cuda {

// What follows from A21 and X = L11^-1, by tiles of 32 x 16 numbers (TileProduct), a warp each: L21 = A21 X^T
// in place, the factor's -L21 X, and the update matrix, less L21 L21^T.

/// Numbers on chip that a warp passes a tile through.
inline constexpr int tile_leading = 36, tile_numbers = 16 * tile_leading;

/// Rows below from `row` on, 4 g of them for a lane; those behind the last stand for it.
__device__ inline int clamped_rows(const Panel& panel, int row) {
  return panel.own + min(row + lane() / 4 * 4, (panel.below + 3) / 4 * 4 - 4);
}

/// A strip of 32 rows of A21, in place, the last columns first: they need all others.
__device__ inline void make_strip(const Panel& panel, int strip) {
  const int g = lane() / 4, t = lane() % 4, row = clamped_rows(panel, 32 * strip);
  for (int column = (panel.own - 1) / 16 * 16; column >= 0; column -= 16) {
    const int end = min(column + 16, panel.own), other = min(column + 8, panel.own - 8) + g;
    TileProduct product;
    const float *from = &panel.at(row, t), *one = &panel.at(t, column + g), *two = &panel.at(t, other);
    for (int k = 0; k < end; k += 8, from += 8 * panel.leading) {
      float2 right[2] = {{one[k], two[k]}, {one[k + 4], two[k + 4]}};
      // Below the diagonal blocks stands L, where X^T is zero.
      if (k > column) right[0].x = right[1].x = 0;
      product.add({four_at(from), four_at(from + 4 * panel.leading)}, right);
    }
    __syncwarp();
    if (32 * strip + 4 * g < panel.below) {
#pragma unroll
      for (int j = 0; j < 4; ++j) {
        const int to = column + 2 * t + j / 2 + 8 * (j % 2);
        if (to < panel.own) panel.set_four(row, to, product.rows(j));
      }
    }
    __syncwarp();
  }
}

/// A strip of -L21 X to the factor, its padding with zeros.
template <typename Stored>
__device__ void store_strip(const FrontLayout& front, const Panel& panel, int strip, Stored* factor) {
  const int g = lane() / 4, t = lane() % 4, row = clamped_rows(panel, 32 * strip);
  const int first = 32 * strip + 4 * g;
  for (int column = 0; column < panel.columns; column += 16) {
    TileProduct product;
    const int other = min(column + 2 * g, panel.own - 2);
    const float *from = &panel.at(row, column + t), *across = &panel.at(other, column + t);
    for (int k = column; k < panel.own; k += 8, from += 8 * panel.leading, across += 8 * panel.leading) {
      float2 right[2] = {two_at(across), two_at(across + 4 * panel.leading)};
      if (k == column && g >= 4) right[0] = right[1] = {0, 0};
      product.add({four_at(from), four_at(from + 4 * panel.leading)}, right);
    }
    if (front.below_at + first >= front.leading) continue;
#pragma unroll
    for (int j = 0; j < 4; ++j) {
      const int to = column + 4 * t + j;
      const float4 sum = product.rows(j);
      const float4 result = {first < panel.below ? -sum.x : 0, first + 1 < panel.below ? -sum.y : 0,
                             first + 2 < panel.below ? -sum.z : 0, first + 3 < panel.below ? -sum.w : 0};
      if (to < panel.columns) store_four(result, factor + to * front.leading + front.below_at + first);
    }
  }
}

/// X to the factor, zeros above its diagonal.
template <typename Stored>
__device__ void store_inverse(const FrontLayout& front, const Panel& panel, Stored* factor) {
  const int warps = panel.group.size / 32;
  for (int row = 4 * (panel.group.rank / 32); row < front.below_at; row += 4 * warps)
    for (int column = lane(); column < panel.columns; column += 32) {
      float numbers[4];
#pragma unroll
      for (int i = 0; i < 4; ++i)
        numbers[i] = row + i < panel.columns && row + i >= column ? panel.at(column, row + i) : 0.0f;
      store_four(float4{numbers[0], numbers[1], numbers[2], numbers[3]},
                 factor + column * front.leading + row);
    }
}

/// Goes through the tiles of a lower triangle, those of a warp's own.
struct TileWalk {
  int row, column, step, below;

  __device__ TileWalk(const Panel& panel)
      : row(0), column(16 * (panel.group.rank / 32)), step(16 * (panel.group.size / 32)), below(panel.below) {
    settle();
  }
  __device__ bool there() const { return row < below; }
  __device__ void advance() {
    column += step;
    settle();
  }

 private:
  /// A strip of 32 rows has the columns up to its diagonal.
  __device__ void settle() {
    while (there()) {
      const int end = min(row + 32, (below + 15) / 16 * 16);
      if (column < end) return;
      column -= end;
      row += 32;
    }
  }
};

/// What the children pass up to a tile, a row each lane: what lies together is read together.
__device__ inline void gather_tile(const Panel& panel, const ChildRows& rows, const TileWalk& tile,
                                   const float* updates, float (&numbers)[2][16]) {
  const int row = tile.row + lane();
#pragma unroll
  for (int k = 0; k < 2; ++k)
    rows.gather(updates, k, row < panel.below ? rows.place(k, panel.own + row) : -1, panel.own + tile.column,
                numbers[k]);
}

/// What the front passes up: what its children do, less L21 L21^T, by tiles of the lower triangle. Above the
/// diagonal stands anything. `chip`: tile_numbers of the warp.
__device__ inline void make_update(const FrontLayout& front, const Panel& panel, const ChildRows& rows,
                                   float* updates, float* chip) {
  const int g = lane() / 4, t = lane() % 4, step = 4 * panel.leading;
  const int last_rows = (panel.below + 3) / 4 * 4 - 4, last_columns = (panel.below + 1) / 2 * 2 - 2;
  const float* below = &panel.at(panel.own, t);
  TileWalk tile(panel);
  float given[2][16];
  if (rows.any && tile.there()) gather_tile(panel, rows, tile, updates, given);
  while (tile.there()) {
    TileWalk next = tile;
    next.advance();
    if (rows.any) {
#pragma unroll
      for (int j = 0; j < 16; ++j) chip[j * tile_leading + lane()] = given[0][j] + given[1][j];
      __syncwarp();
      // The next tile's numbers are on their way while this one's product is made.
      if (next.there()) gather_tile(panel, rows, next, updates, given);
    }
    TileProduct product;
    const int first = tile.row + 4 * g;
    const float *left = below + min(first, last_rows), *right = below + min(tile.column + 2 * g, last_columns);
#pragma unroll 2
    for (int k = 0; k < panel.own; k += 8, left += 2 * step, right += 2 * step)
      product.add({four_at(left), four_at(left + step)}, {two_at(right), two_at(right + step)});
    float* update = kept_whole(updates + front.update_at + first);
#pragma unroll
    for (int j = 0; j < 4; ++j) {
      const int to = tile.column + 4 * t + j;
      float4 sum = {0, 0, 0, 0};
      if (rows.any) sum = four_at(chip + (4 * t + j) * tile_leading + 4 * g);
      const float4 taken = product.rows(j);
      sum = {sum.x - taken.x, sum.y - taken.y, sum.z - taken.z, sum.w - taken.w};
      if (first < panel.below && to < panel.below)
        *reinterpret_cast<float4*>(update + to * front.update_leading) = sum;
    }
    __syncwarp();
    tile = next;
  }
}

}  // namespace flash::sim::cuda
