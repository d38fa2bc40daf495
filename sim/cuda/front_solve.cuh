#pragma once
#include "sim/cuda/chip_memory.cuh"
#include "sim/cuda/front_tables.h"
#include "sim/cuda/solve_tile.cuh"

namespace flash::sim::cuda {

// Solves with the factor of front_factor.cuh. A front's columns W = [L11^-1; -L21 L11^-1] serve both ways:
// forward its own numbers b become [y; u] = W b, u passed up; backward x = W^T [y; x_below]. So the operator
// is F^T F whatever the rounding of W: symmetric and positive definite, as conjugate gradients need it. One
// barrier a level each way; the factor is read twice. It comes from memory by chunks of four tiles, the next
// few of each warp on their way to the chip while it works on one. Tensor cores multiply the factor's half
// precision by inputs in two parts of it, so that what is rounded is the factor alone.

/// A chunk on chip: tiles, where inputs come from, where results go, and the chunk itself [bytes].
template <int parts>
struct ChunkSlot {
  static constexpr int gather_bytes = static_cast<int>(sizeof(Gather)),
                       input_table = 4 * solve_tile_bytes<parts>,
                       result_table = input_table + chunk_width * gather_bytes,
                       chunk = result_table + chunk_width * gather_bytes, chunk_bytes = 32,
                       size = chunk + chunk_bytes;
  static_assert(sizeof(SolveChunk) == chunk_bytes + sizeof(int4));  // whose first numbers stay behind
};

/// On-chip bytes that a solve needs.
template <int parts>
__host__ __device__ constexpr int solve_memory(int depth) {
  return team_warps * depth * ChunkSlot<parts>::size;
}

/// The chunks of a warp, on their way to the chip.
template <int parts>
class ChunkStream {
 public:
  using Slot = ChunkSlot<parts>;

  __device__ ChunkStream(const FrontTables& tables, const __half* factor, const char* chip)
      : gathers_(tables.gathers + lane()),
        factor_(reinterpret_cast<const char*>(factor) + 16 * lane()),
        next_(reinterpret_cast<const int4*>(tables.chunks + tables.chunk_starts[warp()])),
        what_(*next_),
        depth_(tables.solve_depth),
        first_(chip_address(chip) + warp() * depth_ * Slot::size),
        end_(first_ + depth_ * Slot::size),
        free_(first_) {
    for (int k = 1; k < depth_; ++k) send();
  }

  /// Where the next chunk is on chip until the next call.
  __device__ unsigned take() {
    __syncwarp();
    send();
    if (depth_ == 4)
      wait_for_copies<3>();
    else if (depth_ == 2)
      wait_for_copies<1>();
    else
      wait_for_copies<0>();
    __syncwarp();
    return free_;
  }

 private:
  /// Sends the next chunk to the slot that is free, and frees the one after it. Behind the last chunk of a
  /// warp stand some without numbers.
  __device__ void send() {
    constexpr int tile = solve_tile_bytes<parts>, part = solve_tile_bytes<half_parts>;
    const unsigned to = free_ + 16 * lane();
    const char* upper = factor_ + static_cast<long>(what_.x) * tile;
    const char* lower = upper + static_cast<long>(what_.y) * tile;
    const bool two_rows = what_.y != 0, two_columns = what_.z & 1;
#pragma unroll
    for (int p = 0; p < parts; ++p) {
      copy_to_chip<16>(to + p * part, upper + p * part);
      if (two_columns) copy_to_chip<16>(to + tile + p * part, upper + tile + p * part);
      if (two_rows) copy_to_chip<16>(to + 2 * tile + p * part, lower + p * part);
      if (two_rows && two_columns) copy_to_chip<16>(to + 3 * tile + p * part, lower + tile + p * part);
    }
    copy_to_chip<8>(free_ + Slot::input_table + 8 * lane(), gathers_ + what_.w);
    if (what_.z >= 0) copy_to_chip<8>(free_ + Slot::result_table + 8 * lane(), gathers_ + (what_.z >> 1));
    if (lane() < Slot::chunk_bytes / 16) copy_to_chip<16>(to + Slot::chunk, next_ + 1 + lane());
    end_copies();
    next_ += sizeof(SolveChunk) / sizeof(int4);
    what_ = *next_;
    free_ += Slot::size;
    if (free_ == end_) free_ = first_;
  }

  const Gather* gathers_;
  const char* factor_;
  const int4* next_;
  int4 what_;  ///< the first numbers of the chunk that is sent next
  int depth_;
  unsigned first_, end_, free_;
};

/// Multiplies by the chunk at `slot`. `sums`: of the chunks of the task so far, of the rows lane() / 4 + 8 k;
/// zero at first. Returns SolveChunk::flags.
template <int parts, bool backward>
__device__ int run_chunk(unsigned slot, float* vector, float (&sums)[4]) {
  using Slot = ChunkSlot<parts>;
  const int4 chunk = load_int4(slot + Slot::chunk);
  const int flags = chunk.x, inputs = chunk.y, right_at = chunk.z;
  if (inputs == 0) return flags;
  const int2 from = load_int2(slot + Slot::input_table + 8 * lane());
  float input = vector[from.x];
  if (!backward) input += vector[from.y] + vector[right_at + lane()];
  if (lane() >= inputs) input = 0;
  const HalfScale scale(largest_of_warp(fabsf(input)));
  const HalfPair pair(scale.to * input);
  const unsigned word = word_of(pair.high, pair.low);

  // Of results that there are none of, products are anything.
  float products[2][4] = {};
  const auto add = [&](int input_half) {
    const RightInputs right = right_inputs(word, input_half * solve_tile_width);
#pragma unroll
    for (int i = 0; i < 2; ++i)
#pragma unroll
      for (int part = 0; part < parts; ++part) {
        const int tile = backward ? 2 * input_half + i : 2 * i + input_half;
        add_tile_product(products[i],
                         load_solve_tile<backward>(slot + tile * solve_tile_bytes<parts> +
                                                   part * solve_tile_bytes<half_parts>),
                         right);
      }
  };
  add(0);
  if (inputs > solve_tile_width) add(1);
#pragma unroll
  for (int k = 0; k < 4; ++k)
    sums[k] += scale.back * (products[k / 2][k % 2 * 2] + products[k / 2][k % 2 * 2 + 1]);

  if (flags & SolveChunk::ends) {
    // Four lanes have the same four rows; each keeps one.
    const int t = lane() % 4, row = 8 * t + lane() / 4;
    const float result = t < 2 ? (t == 0 ? sums[0] : sums[1]) : (t == 2 ? sums[2] : sums[3]);
    const int own_at = chunk.w;
    const int4 end = load_int4(slot + Slot::chunk + 16);
    if (row < end.x) {
      vector[own_at + row] = result;
    } else if (!backward && row >= end.z && row < end.w) {
      const int2 passed = load_int2(slot + Slot::result_table + 8 * row);
      vector[end.y + row] = result + vector[passed.x] + vector[passed.y];
    }
#pragma unroll
    for (float& sum : sums) sum = 0;
  }
  return flags;
}

/// All heights upwards, or downwards.
template <int parts, bool backward>
__device__ void run_levels(int count, ChunkStream<parts>& stream, float* vector) {
  float sums[4] = {};
  for (int level = 0; level < count; ++level) {
    __syncthreads();
    while (!(run_chunk<parts, backward>(stream.take(), vector, sums) & SolveChunk::ends_level)) {
    }
  }
}

/// x <- (L L^T)^-1 x, x behind the first 3 a vertex of `vector`, whose layout is that of solve_chunk.h.
/// `chip`: solve_memory. `on_chip`: whether `vector` is there too.
template <int parts, bool on_chip>
__device__ void solve(const FrontTables& tables, const __half* factor, float* vector, const char* chip) {
#ifdef __CUDA_ARCH__
  if (on_chip) __builtin_assume(__isShared(vector));
#endif
  ChunkStream<parts> stream(tables, factor, chip);
  if (threadIdx.x == 0) vector[6 * tables.size] = 0;
  run_levels<parts, false>(tables.level_count, stream, vector);
  run_levels<parts, true>(tables.level_count, stream, vector);
  wait_for_copies<0>();
  __syncthreads();
}

}  // namespace flash::sim::cuda
