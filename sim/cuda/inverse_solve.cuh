#pragma once
#include "sim/cuda/projective_numbers.h"
#include "sim/cuda/solve_tile.cuh"
#include "sim/cuda/team_sum.cuh"

namespace flash::sim::cuda {

// Products with A^-1 as sim/cuda/layout/inverse_tree.h divides them, three columns at a time, by tensor
// cores: a warp has up to two rows of tiles of a node. Vectors are sums of two numbers of half precision, so
// that the tiles alone are rounded. Of each tile of D^-1 and twice of W 512 bytes are read, or 1,024 in
// single precision; barriers: two a level down, one a level up.

/// A vector of a solve, three numbers a slot: for each block of sixteen slots the high and the low parts of
/// x, of y and of z, as a right factor has its columns.
struct SplitVector {
  __half* halves;

  static constexpr int block_halves = 6 * inverse_tile;

  /// Where a word of two slots is in its column, so that lanes read different banks.
  __device__ static int word(int pair, int column) { return 8 * column + (pair ^ (column & 4)); }
  __device__ static int place(int slot, int column) {
    return slot / inverse_tile * block_halves + 2 * word(slot % inverse_tile / 2, column) + slot % 2;
  }
  __device__ void set(int slot, int c, float number) const {
    const HalfPair pair(number);
    halves[place(slot, 2 * c)] = pair.high;
    halves[place(slot, 2 * c + 1)] = pair.low;
  }
  __device__ float at(int slot, int c) const {
    return __half2float(halves[place(slot, 2 * c)]) + __half2float(halves[place(slot, 2 * c + 1)]);
  }
  /// A block as a right factor.
  __device__ RightInputs block(int block) const {
    const int g = lane() / 4, t = lane() % 4;
    RightInputs right = {{0, 0}};
    if (g >= 6) return right;
    const unsigned* words = reinterpret_cast<const unsigned*>(halves + block * block_halves);
    right.words[0] = words[word(t, g)];
    right.words[1] = words[word(t + 4, g)];
    return right;
  }
  /// Minus sixteen slots as a right factor.
  __device__ RightInputs minus(const int* slots) const {
    const int g = lane() / 4, t = lane() % 4;
    RightInputs right = {{0, 0}};
    if (g >= 6) return right;
#pragma unroll
    for (int k = 0; k < 2; ++k) {
      const int2 pair = *reinterpret_cast<const int2*>(slots + 2 * t + 8 * k);
      right.words[k] = word_of(halves[place(pair.x, g)], halves[place(pair.y, g)]) ^ 0x80008000u;
    }
    return right;
  }
};

__device__ inline unsigned transposed_square(unsigned square) {
  unsigned turned;
  asm("movmatrix.sync.aligned.m8n8.trans.b16 %0, %1;" : "=r"(turned) : "r"(square));
  return turned;
}

/// What an environment's solves work on.
struct InverseWork {
  const InverseTables& tables;
  const uint4* tiles;    ///< in memory
  const uint4* on_chip;  ///< the first so many of them
  int on_chip_count;
  const float* scale;
  SplitVector right, solved;
  float* passed;
};

template <int parts, bool transposed>
__device__ LeftTileHalf load_inverse_tile(const InverseWork& w, int tile, int part) {
  const int at = (tile * parts + part) * 32 + lane();
  const uint4 words = (tile < w.on_chip_count ? w.on_chip : w.tiles)[at];
  if constexpr (transposed)
    return {{transposed_square(words.x), transposed_square(words.z), transposed_square(words.y),
             transposed_square(words.w)}};
  return {{words.x, words.y, words.z, words.w}};
}

/// Sums of two rows of tiles with the same inputs, in parts.
template <int parts>
struct TwoRows {
  float sums[parts][2][4] = {};

  /// Adds `count` products of tiles, from the first ones of both rows on, `step` tiles apart, with right(k).
  /// All of what a few products read is on its way together; those beyond the last one are with zeros.
  template <bool transposed, typename Right>
  __device__ void add(const InverseWork& w, int first, int second, int step, int count, const Right& right) {
    constexpr int together = 4 / parts;
    for (int base = 0; base < count; base += together) {
      LeftTileHalf left[together][parts][2];
      RightInputs inputs[together];
#pragma unroll
      for (int k = 0; k < together; ++k) {
        const int at = min(base + k, count - 1);
#pragma unroll
        for (int part = 0; part < parts; ++part) {
          left[k][part][0] = load_inverse_tile<parts, transposed>(w, first + at * step, part);
          left[k][part][1] = load_inverse_tile<parts, transposed>(w, second + at * step, part);
        }
        inputs[k] = right(at);
        if (base + k >= count) inputs[k] = {{0, 0}};
      }
#pragma unroll
      for (int k = 0; k < together; ++k)
#pragma unroll
        for (int part = 0; part < parts; ++part)
#pragma unroll
          for (int row = 0; row < 2; ++row) add_tile_product(sums[part][row], left[k][part][row], inputs[k]);
    }
  }
  /// Of the lane's column in row 8 `half` + lane() / 4 of a row of tiles: the product with both parts.
  __device__ float at(int row, int half) const {
    constexpr float per_low = 1 / low_scale;
    float sum = sums[0][row][2 * half] + sums[0][row][2 * half + 1];
    if constexpr (parts == 2) sum += per_low * (sums[1][row][2 * half] + sums[1][row][2 * half + 1]);
    return sum;
  }
};

/// Takes what was passed to the slots of a level off them.
__device__ inline void gather_passed(const InverseWork& w, const InverseLevel& level) {
  const InverseNode &first = w.tables.nodes[level.first_node],
                    &last = w.tables.nodes[level.first_node + level.node_count - 1];
  const int begin = inverse_tile * first.first_block,
            count = inverse_tile * (last.first_block + last.column_tiles) - begin;
  for (int k = team_rank(); k < 3 * count; k += team_size()) {
    const int slot = begin + k / 3, c = k % 3;
    const int start = w.tables.gather_starts[slot], end = w.tables.gather_starts[slot + 1];
    if (start == end) continue;
    float sum = 0;
    for (int g = start; g < end; ++g) sum += w.passed[3 * w.tables.gathered[g] + c];
    w.right.set(slot, c, w.right.at(slot, c) - sum);
  }
}

/// W b of a node for up to two rows of tiles.
template <int parts>
__device__ void pass_down(const InverseWork& w, const InverseTask& task) {
  const InverseNode node = w.tables.nodes[task.node];
  const int columns = node.column_tiles, first_W = node.first_tile + columns * columns;
  const int row = first_W + task.first * columns, next = row + (task.count > 1 ? columns : 0);
  TwoRows<parts> rows;
  rows.template add<false>(w, row, next, 1, columns,
                           [&](int k) { return w.right.block(node.first_block + k); });
  const int c = lane() % 4;
  if (c == 3) return;
#pragma unroll
  for (int r = 0; r < 2; ++r)
#pragma unroll
    for (int half = 0; half < 2; ++half)
      if (r < task.count)
        w.passed[3 * (node.first_below + inverse_tile * (task.first + r) + 8 * half + lane() / 4) + c] =
            rows.at(r, half);
}

/// x = D^-1 b - W^T x_below for up to two blocks of a node, to `motion` too, times `back` and the scale.
template <int parts>
__device__ void pass_up(const InverseWork& w, const InverseTask& task, bool keep, float back, float* motion) {
  const InverseNode node = w.tables.nodes[task.node];
  const int columns = node.column_tiles, first_W = node.first_tile + columns * columns;
  const int row = node.first_tile + task.first * columns, next = row + (task.count > 1 ? columns : 0);
  TwoRows<parts> rows;
  rows.template add<false>(w, row, next, 1, columns,
                           [&](int k) { return w.right.block(node.first_block + k); });
  const int column = first_W + task.first, beside = column + (task.count > 1 ? 1 : 0);
  rows.template add<true>(w, column, beside, columns, node.below_tiles, [&](int k) {
    return w.solved.minus(w.tables.below + node.first_below + inverse_tile * k);
  });
  const int c = lane() % 4;
  if (c == 3) return;
#pragma unroll
  for (int r = 0; r < 2; ++r)
#pragma unroll
    for (int half = 0; half < 2; ++half) {
      if (r >= task.count) continue;
      const int slot = inverse_tile * (node.first_block + task.first + r) + 8 * half + lane() / 4;
      const float x = rows.at(r, half);
      if (keep) w.solved.set(slot, c, x);
      const int place = w.tables.place_at[slot];
      if (place >= 0) motion[3 * place + c] = back * w.scale[slot] * x;
    }
}

/// A power of two that takes numbers up to `largest` to less than a 32nd, and one over it: solutions of the
/// scaled system are up to thousands of times as large, and half precision ends at 65,504.
struct SolveScale {
  float to, back;

  __device__ explicit SolveScale(float largest) {
    constexpr int bias = 127, room = 6;
    const int exponent =
        min(max(static_cast<int>(__float_as_uint(largest) >> 23), room + 2), 2 * bias - room - 2);
    to = __uint_as_float(static_cast<unsigned>(2 * bias - room - exponent) << 23);
    back = __uint_as_float(static_cast<unsigned>(exponent + room) << 23);
  }
};

/// motion = A^-1 b, zero where vertices are held. `largest`: of the scaled b; own(place) gives that of a
/// vertex. The caller has synchronized what own reads; a barrier ends it.
template <int parts, typename Own>
__device__ void solve_inverse(const InverseWork& w, float largest, const Own& own, int size, float* motion) {
  const SolveScale scale(largest);
  for (int i = team_rank(); i < size; i += team_size()) {
    const int slot = w.tables.slot_of[i];
    const Vector3<float> b = own(i);
    w.right.set(slot, 0, scale.to * b.x);
    w.right.set(slot, 1, scale.to * b.y);
    w.right.set(slot, 2, scale.to * b.z);
  }
  synchronize_team();
  for (int l = 0; l < w.tables.level_count; ++l) {
    const InverseLevel level = w.tables.levels[l];
    if (l > 0) {
      gather_passed(w, level);
      synchronize_team();
    }
    if (level.down_count == 0) continue;
    for (int t = team_warp(); t < level.down_count; t += team_warps())
      pass_down<parts>(w, w.tables.tasks[level.first_down + t]);
    synchronize_team();
  }
  for (int l = w.tables.level_count - 1; l >= 0; --l) {
    const InverseLevel level = w.tables.levels[l];
    for (int t = team_warp(); t < level.up_count; t += team_warps())
      pass_up<parts>(w, w.tables.tasks[level.first_up + t], l > 0, scale.back, motion);
    synchronize_team();
  }
}

}  // namespace flash::sim::cuda
