#pragma once
#include "sim/cuda/projective_numbers.h"
#include "sim/cuda/solve_tile.cuh"
#include "sim/cuda/team_sum.cuh"

namespace flash::sim::cuda {

// Products with A^-1 as sim/cuda/layout/inverse_tree.h divides them, three columns at a time, by tensor
// cores: a warp has one or two rows of tiles of a node. Vectors are sums of two numbers of half precision, so
// that the tiles alone are rounded. Of each tile of D^-1 and twice of W 512 bytes are read, or 1,024 in
// single precision; barriers: two a level down, one a level up.

__device__ inline unsigned transposed_square(unsigned square) {
  unsigned turned;
  asm("movmatrix.sync.aligned.m8n8.trans.b16 %0, %1;" : "=r"(turned) : "r"(square));
  return turned;
}

/// What an environment's solves work on. Vectors and tables stand as `keeping` says.
template <Keeping keeping>
struct InverseWork {
  SolveLayout places;
  int begin;                 ///< bytes from the start of the memory on chip
  char* memory;              ///< of the team, where it is not on chip
  const uint4* tiles;        ///< in the device's memory
  int tiles_at, near_tiles;  ///< on chip: the first so many of them

  template <typename Number>
  __device__ Number* at(int place) const {
    if constexpr (keeping != Keeping::memory)
      return reinterpret_cast<Number*>(shared_memory<char>() + begin + place);
    else
      return reinterpret_cast<Number*>(memory + place);
  }
  /// Writes a number for all blocks of the team.
  template <typename Number>
  __device__ void put(int place, const Number& number) const {
    cuda::put<keeping>(at<Number>(place), number);
  }
  /// Of a solution: x, y and z of a slot, times SolveScale::to.
  __device__ const Four<float>& solution(int slot) const { return at<Four<float>>(places.exchange)[slot]; }

  // Vectors of a solve in halves.

  __device__ void put_split(int place, float number) const {
    const HalfPair pair(number);
    put(place, pair.high);
    put(place + low_part_bytes, pair.low);
  }
  __device__ float split_at(int place) const {
    return __half2float(*at<__half>(place)) + __half2float(*at<__half>(place + low_part_bytes));
  }
  /// `place`: place_in_vector of a slot.
  __device__ void set_right(int place, const Vector3<float>& b) const {
    place += places.right;
    put_split(place, b.x);
    put_split(place + component_bytes, b.y);
    put_split(place + 2 * component_bytes, b.z);
  }
  /// A block of the right-hand side as a right factor.
  __device__ RightInputs right_block(int block) const {
    const uint2 words = at<uint2>(places.right + block * vector_block_bytes)[lane()];
    return {{words.x, words.y}};
  }
  /// Sixteen solved slots as a right factor; `row`: the first of them in InverseTree::below.
  __device__ RightInputs solved_below(int row) const {
    const int4 from = at<int4>(places.below + 4 * row)[lane() % 4];
    const int column = places.solved + low_part_bytes * (lane() / 4);
    const auto half = [&](int place) { return *at<__half>(column + place); };
    return {{word_of(half(from.x), half(from.y)), word_of(half(from.z), half(from.w))}};
  }
};

/// Sums of one or two rows of tiles with the same inputs.
template <int parts, int rows>
struct TileRows {
  float sums[parts][rows][4] = {};

  template <bool transposed>
  __device__ static LeftTileHalf left_of(const uint4& words) {
    if constexpr (transposed)
      return {{transposed_square(words.x), transposed_square(words.z), transposed_square(words.y),
               transposed_square(words.w)}};
    return {{words.x, words.y, words.z, words.w}};
  }
  /// Adds products with right(k) of the tiles from `tiles` on, `step` apart, and in the second row of those
  /// `next` further: those from k = `base` on. All that they read is on its way together.
  template <bool transposed, int count, typename Right>
  __device__ void add_some(const uint4* tiles, int next, int step, int base, const Right& right) {
    constexpr int words = 32 * parts;
    uint4 left[count][parts][rows];
    RightInputs inputs[count];
    tiles += words * (base * step);
#pragma unroll
    for (int k = 0; k < count; ++k) {
#pragma unroll
      for (int row = 0; row < rows; ++row)
#pragma unroll
        for (int part = 0; part < parts; ++part)
          left[k][part][row] = tiles[words * (step * k + next * row) + 32 * part];
      inputs[k] = right(base + k);
    }
#pragma unroll
    for (int k = 0; k < count; ++k)
#pragma unroll
      for (int part = 0; part < parts; ++part)
#pragma unroll
        for (int row = 0; row < rows; ++row)
          add_tile_product(sums[part][row], left_of<transposed>(left[k][part][row]), inputs[k]);
  }
  /// All `count` of them.
  template <bool transposed, typename Right>
  __device__ void add(const uint4* tiles, int next, int step, int count, const Right& right) {
    constexpr int together = 4 / parts;
    int base = 0;
    for (; base + together <= count; base += together)
      add_some<transposed, together>(tiles, next, step, base, right);
    if constexpr (together > 2) {
      if (base + 2 <= count) {
        add_some<transposed, 2>(tiles, next, step, base, right);
        base += 2;
      }
    }
    if (base < count) add_some<transposed, 1>(tiles, next, step, base, right);
  }
  /// Of the lane's component, lane() % 4, in row 8 `half` + lane() / 4 of a row of tiles: with both parts.
  __device__ float at(int row, int half) const {
    constexpr float per_low = 1 / low_scale;
    float sum = sums[0][row][2 * half] + sums[0][row][2 * half + 1];
    if constexpr (parts == 2) sum += per_low * (sums[1][row][2 * half] + sums[1][row][2 * half + 1]);
    return sum;
  }
};

/// The products of a task. Tiles of W are on chip all, or read from memory; likewise those of D^-1.
template <int parts, int rows, Keeping keeping>
__device__ TileRows<parts, rows> products_of(const InverseWork<keeping>& w, const SolveTask& task) {
  constexpr int words = 32 * parts;
  const uint4* near = reinterpret_cast<const uint4*>(shared_memory<char>() + w.tiles_at) + lane();
  const uint4* far = kept_whole(w.tiles + lane());
  TileRows<parts, rows> sums;
  const auto own = [&](int k) { return w.right_block(task.first_input + k); };
  if (task.first_tile + rows * task.columns <= w.near_tiles)
    sums.template add<false>(near + words * task.first_tile, task.columns, 1, task.columns, own);
  else
    sums.template add<false>(far + words * task.first_tile, task.columns, 1, task.columns, own);
  const auto below = [&](int k) { return w.solved_below(task.first_below + inverse_tile * k); };
  if (task.first_column + rows + task.columns * (task.below_tiles - 1) <= w.near_tiles)
    sums.template add<true>(near + words * task.first_column, 1, task.columns, task.below_tiles, below);
  else
    sums.template add<true>(far + words * task.first_column, 1, task.columns, task.below_tiles, below);
  return sums;
}

/// Passes W b of a task on; a lane has a component of four rows, of which the fourth is nothing.
template <int parts, int rows, Keeping keeping>
__device__ void pass_down(const InverseWork<keeping>& w, const SolveTask& task) {
  const TileRows<parts, rows> sums = products_of<parts, rows>(w, task);
#pragma unroll
  for (int row = 0; row < rows; ++row)
#pragma unroll
    for (int half = 0; half < 2; ++half)
      w.put(w.places.exchange + 16 * (task.first_result + inverse_tile * row + 8 * half) + 4 * lane(),
            sums.at(row, half));
}

/// x = D^-1 b + W^T x_below of a task.
template <int parts, int rows, Keeping keeping>
__device__ void pass_up(const InverseWork<keeping>& w, const SolveTask& task, bool keep) {
  const TileRows<parts, rows> sums = products_of<parts, rows>(w, task);
  const int c = lane() % 4;
#pragma unroll
  for (int row = 0; row < rows; ++row)
#pragma unroll
    for (int half = 0; half < 2; ++half) {
      const int slot = task.first_result + inverse_tile * row + 8 * half;
      const float x = sums.at(row, half);
      w.put(w.places.exchange + 16 * slot + 4 * lane(), x);
      if (keep && c < 3)
        w.put_split(w.places.solved + place_in_vector(slot - w.places.first_upper) +
                        place_in_vector(lane() / 4) + component_bytes * c,
                    x);
    }
}

/// Adds what was passed to the slots of a level.
template <Keeping keeping>
__device__ void gather_passed(const InverseWork<keeping>& w, const SolveLevel& level) {
  const int* starts = w.template at<int>(w.places.gather_starts) - w.places.first_upper;
  const int* gathered = w.template at<int>(w.places.gathered);
  const auto* passed = w.template at<Four<float>>(w.places.exchange);
  for (int slot = level.first_slot + team_rank(); slot < level.end_slot; slot += team_size()) {
    const int start = starts[slot], end = starts[slot + 1];
    if (start == end) continue;
    const int place = place_in_vector(slot), from = w.places.right + place;
    Vector3<float> sum = {w.split_at(from), w.split_at(from + component_bytes),
                          w.split_at(from + 2 * component_bytes)};
    for (int g = start; g < end; ++g) {
      const Four<float> own = passed[gathered[g]];
      sum = sum + Vector3<float>{own.x, own.y, own.z};
    }
    w.set_right(place, sum);
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

template <int parts, Keeping keeping>
__device__ inline void run_task(const InverseWork<keeping>& w, int index, bool down, bool keep) {
  const SolveTask task = w.template at<SolveTask>(w.places.tasks)[index];
  if (down) {
    if (task.rows == 2)
      pass_down<parts, 2>(w, task);
    else
      pass_down<parts, 1>(w, task);
  } else {
    if (task.rows == 2)
      pass_up<parts, 2>(w, task, keep);
    else
      pass_up<parts, 1>(w, task, keep);
  }
}

/// Solves with the right-hand side that set_right has left; all threads. Barriers begin and end it. Then
/// w.solution has the solution.
template <int parts, Keeping keeping>
__device__ __noinline__ void solve_inverse(const InverseWork<keeping>& work) {
  const InverseWork<keeping> w = work;  // in registers
  const auto* levels = w.template at<SolveLevel>(w.places.levels);
  synchronize_team();
  for (int l = 0; l < w.places.level_count; ++l) {
    const SolveLevel level = levels[l];
    if (l > 0) {
      gather_passed(w, level);
      synchronize_team();
    }
    if (level.down_count == 0) continue;
    for (int t = team_warp(); t < level.down_count; t += team_warps())
      run_task<parts>(w, level.first_down + t, true, false);
    synchronize_team();
  }
  for (int l = w.places.level_count - 1; l >= 0; --l) {
    const SolveLevel level = levels[l];
    for (int t = team_warp(); t < level.up_count; t += team_warps())
      run_task<parts>(w, level.first_up + t, false, l > 0);
    synchronize_team();
  }
}

}  // namespace flash::sim::cuda
