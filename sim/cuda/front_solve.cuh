#pragma once
#include "sim/cuda/chip_memory.cuh"
#include "sim/cuda/front_tables.h"
#include "sim/cuda/solve_tile.cuh"

namespace flash::sim::cuda {

// Solves with the factor of front_factor.cuh. A front's columns W = [L11^-1; -L21 L11^-1] serve both ways:
// forward its own numbers b become [y; u] = W b, u passed up; backward x = W^T [y; x_below]. So the operator
// is F^T F whatever the rounding of W: symmetric and positive definite, as conjugate gradients need it. One
// barrier a level each way; the factor is read twice. It comes from memory by chunks of four tiles, the next
// few of each warp on their way to the chip while it works on others. Tensor cores multiply the factor's half
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
  return block_warps * depth * ChunkSlot<parts>::size;
}

/// Chunks that a warp works on side by side, where it has `depth` of them on chip. Each waits for numbers
/// most of the time; with two a warp waits for both at once.
__host__ __device__ constexpr int chunks_side_by_side(int depth) {
  return depth >= 2 * chunks_together ? chunks_together : 1;
}

/// The chunks of a warp, on their way to the chip, `width` at a time.
template <int parts, int width>
class ChunkStream {
 public:
  using Slot = ChunkSlot<parts>;

  __device__ ChunkStream(const FrontTables& tables, const __half* factor, const char* chip)
      : gathers_(tables.gathers + lane()),
        factor_(reinterpret_cast<const char*>(factor) + 16 * lane()),
        next_(reinterpret_cast<const int4*>(tables.chunks + tables.chunk_starts[team_warp()])),
        depth_(tables.solve_depth),
        first_(chip_address(chip) + warp() * depth_ * Slot::size),
        end_(first_ + depth_ * Slot::size),
        free_(first_),
        policy_(leaves_first()) {
#pragma unroll
    for (int k = 0; k < width; ++k) what_[k] = next_[chunk_words * k];
    for (int k = width; k < depth_; k += width) send();
  }

  /// Where the next `width` chunks are on chip until the next call, one behind the other.
  __device__ unsigned take() {
    __syncwarp();
    send();
    if (depth_ == 4 * width)
      wait_for_copies<3>();
    else if (depth_ == 2 * width)
      wait_for_copies<1>();
    else
      wait_for_copies<0>();
    __syncwarp();
    return free_;
  }

 private:
  static constexpr int chunk_words = sizeof(SolveChunk) / sizeof(int4);

  /// Sends the next chunks to the slots that are free, and frees those after them. Behind the last chunk of a
  /// warp stand some without numbers.
  __device__ void send() {
    constexpr int tile = solve_tile_bytes<parts>, part = solve_tile_bytes<half_parts>;
#pragma unroll
    for (int k = 0; k < width; ++k) {
      const int4 what = what_[k];
      const unsigned slot = free_ + k * Slot::size, to = slot + 16 * lane();
      if (const int squares = squares_of(what.y); squares != 0) {
        const char* upper = factor_ + static_cast<long>(what.x) * tile;
        const char* lower = upper + static_cast<long>(next_row_of(what.y)) * tile;
        const bool two_rows = next_row_of(what.y) != 0, two_columns = what.z & 1;
        // Eight lanes have a square: 16 bytes of it or, in its place, zeros.
        const int own_squares = squares >> lane() / 8;
        const auto bytes = [&](int k) { return 16 * (own_squares >> tile_squares * k & 1); };
#pragma unroll
        for (int p = 0; p < parts; ++p) {
          copy_to_chip(to + p * part, upper + p * part, bytes(0), policy_);
          if (two_columns) copy_to_chip(to + tile + p * part, upper + tile + p * part, bytes(1), policy_);
          if (two_rows) copy_to_chip(to + 2 * tile + p * part, lower + p * part, bytes(2), policy_);
          if (two_rows && two_columns)
            copy_to_chip(to + 3 * tile + p * part, lower + tile + p * part, bytes(3), policy_);
        }
        copy_to_chip<8>(slot + Slot::input_table + 8 * lane(), gathers_ + what.w);
        if (what.z >= 0) copy_to_chip<8>(slot + Slot::result_table + 8 * lane(), gathers_ + (what.z >> 1));
      }
      if (lane() < Slot::chunk_bytes / 16)
        copy_to_chip<16>(to + Slot::chunk, next_ + chunk_words * k + 1 + lane());
    }
    end_copies();
    next_ += chunk_words * width;
#pragma unroll
    for (int k = 0; k < width; ++k) what_[k] = next_[chunk_words * k];
    free_ += width * Slot::size;
    if (free_ == end_) free_ = first_;
  }

  const Gather* gathers_;
  const char* factor_;
  const int4* next_;
  int4 what_[width];  ///< the first numbers of the chunks that are sent next
  int depth_;
  unsigned first_, end_, free_;
  CachePolicy policy_;  ///< a factor does not stay in the cache from one solve to the next
};

/// The inputs of a chunk in half precision.
struct ChunkInputs {
  RightInputs halves[2];
  float scale;  ///< of products with them
};

/// What a solve works on: in memory, or on chip with a copy in each block of the team.
template <bool on_chip>
struct SolveVector {
  float* numbers;

  __device__ float operator[](int i) const { return numbers[i]; }
  /// `to_all`: in all copies.
  __device__ void set(int i, float number, bool to_all) const {
    if (on_chip && to_all)
      put_in_all(numbers + i, number);
    else
      numbers[i] = number;
  }
};

/// Writes the results of a task, whose chunks added up to `sums`. `flags`: of its last chunk.
template <int parts, bool backward, typename Vector>
__device__ void finish_task(unsigned slot, int flags, int own_at, const float (&sums)[4],
                            const Vector& vector) {
  using Slot = ChunkSlot<parts>;
  // Four lanes have the same four rows; each keeps one.
  const int t = lane() % 4, row = 8 * t + lane() / 4;
  const float result = t < 2 ? (t == 0 ? sums[0] : sums[1]) : (t == 2 ? sums[2] : sums[3]);
  const int4 end = load_int4(slot + Slot::chunk + 16);
  if (row < end.x) {
    vector.set(own_at + row, result, flags & SolveChunk::own_to_all);
  } else if (!backward && row >= end.z && row < end.w) {
    const int2 passed = load_int2(slot + Slot::result_table + 8 * row);
    vector.set(end.y + row, result + vector[passed.x] + vector[passed.y], flags & SolveChunk::passed_to_all);
  }
}

/// Multiplies by the `width` chunks from `first_slot` on, none of which needs what another gives. `sums`: of
/// the chunks of the task so far, of the rows lane() / 4 + 8 k; zero at first. Returns the SolveChunk::flags
/// of the last one.
template <int parts, bool backward, int width, typename Vector>
__device__ int run_chunks(unsigned first_slot, const Vector& vector, float (&sums)[4]) {
  using Slot = ChunkSlot<parts>;
  const auto slot = [&](int k) { return first_slot + k * Slot::size; };
  int4 chunks[width];
#pragma unroll
  for (int k = 0; k < width; ++k) chunks[k] = load_int4(slot(k) + Slot::chunk);
  // Warps that have nothing to do leave the processor to those that others wait for.
  if (chunks[0].y == 0) return chunks[width - 1].x;
  if constexpr (width > 1)
    if (chunks[1].y == 0) {
      run_chunks<parts, backward, 1>(first_slot, vector, sums);
      return chunks[width - 1].x;
    }
  int2 from[width];
#pragma unroll
  for (int k = 0; k < width; ++k) from[k] = load_int2(slot(k) + Slot::input_table + 8 * lane());
  float inputs[width] = {};
#pragma unroll
  for (int k = 0; k < width; ++k)
    if (lane() < chunks[k].y) {
      inputs[k] = vector[from[k].x] + vector[from[k].y];
      if (!backward) inputs[k] += vector[chunks[k].z + lane()];
    }
  float largest[width];
#pragma unroll
  for (int k = 0; k < width; ++k) largest[k] = largest_of_warp(fabsf(inputs[k]));
  ChunkInputs rights[width];
#pragma unroll
  for (int k = 0; k < width; ++k) {
    const HalfScale scale(largest[k]);
    const HalfPair pair(scale.to * inputs[k]);
    const unsigned word = word_of(pair.high, pair.low);
#pragma unroll
    for (int half = 0; half < 2; ++half) rights[k].halves[half] = right_inputs(word, half * solve_tile_width);
    rights[k].scale = scale.back;
  }
#pragma unroll
  for (int k = 0; k < width; ++k) {
    const int flags = chunks[k].x, input_count = chunks[k].y;
    if (input_count == 0) continue;
    // Of results that there are none of, products are anything.
    float products[2][4] = {};
    const auto add = [&](int input_half) {
#pragma unroll
      for (int i = 0; i < 2; ++i)
#pragma unroll
        for (int part = 0; part < parts; ++part) {
          const int tile = backward ? 2 * input_half + i : 2 * i + input_half;
          add_tile_product(products[i],
                           load_solve_tile<backward>(slot(k) + tile * solve_tile_bytes<parts> +
                                                     part * solve_tile_bytes<half_parts>),
                           rights[k].halves[input_half]);
        }
    };
    add(0);
    if (input_count > solve_tile_width) add(1);
#pragma unroll
    for (int r = 0; r < 4; ++r)
      sums[r] += rights[k].scale * (products[r / 2][r % 2 * 2] + products[r / 2][r % 2 * 2 + 1]);
    if (flags & SolveChunk::ends) {
      finish_task<parts, backward>(slot(k), flags, chunks[k].w, sums, vector);
#pragma unroll
      for (float& sum : sums) sum = 0;
    }
  }
  return chunks[width - 1].x;
}

/// All heights upwards, or downwards. Blocks of a team wait for each other only where they share fronts.
/// Behind a barrier.
template <int parts, bool backward, int width, typename Vector>
__device__ void run_levels(int count, ChunkStream<parts, width>& stream, const Vector& vector) {
  float sums[4] = {};
  for (int level = 0; level < count; ++level) {
    int flags;
    do flags = run_chunks<parts, backward, width>(stream.take(), vector, sums);
    while (!(flags & SolveChunk::ends_level));
    if (flags & SolveChunk::next_is_shared)
      synchronize_team();
    else
      __syncthreads();
  }
}

template <int parts, int width, typename Vector>
__device__ void run_both_ways(const FrontTables& tables, const __half* factor, const Vector& vector,
                              const char* chip) {
  ChunkStream<parts, width> stream(tables, factor, chip);
  run_levels<parts, false>(tables.level_count, stream, vector);
  run_levels<parts, true>(tables.level_count, stream, vector);
  wait_for_copies<0>();
}

/// Adds up what of the solution comes in two parts, in each copy.
template <bool on_chip>
__device__ void add_second_parts(const FrontTables& tables, float* vector) {
  const int first = on_chip ? static_cast<int>(threadIdx.x) : team_rank(),
            step = on_chip ? block_threads : team_size();
  for (int k = first; k < tables.parted_count; k += step) {
    const Gather parts = tables.parted[k];
    vector[parts.first] += vector[parts.second];
  }
  if (on_chip)
    __syncthreads();
  else
    synchronize_team();
}

/// The zero of a vector; to be there before a solve.
__device__ inline void put_zero(const FrontTables& tables, float* vector) {
  if (threadIdx.x == 0) vector[6 * tables.size] = 0;
}

/// x <- (L L^T)^-1 x, x behind the first 3 a vertex of `vector`, whose layout is that of solve_chunk.h. It is
/// there, put_zero too, behind a barrier. `chip`: solve_memory. `on_chip`: whether `vector` is there too.
template <int parts, bool on_chip>
__device__ void solve(const FrontTables& tables, const __half* factor, float* vector, const char* chip) {
#ifdef __CUDA_ARCH__
  if (on_chip) __builtin_assume(__isShared(vector));
#endif
  if (chunks_side_by_side(tables.solve_depth) == chunks_together)
    run_both_ways<parts, chunks_together>(tables, factor, SolveVector<on_chip>{vector}, chip);
  else
    run_both_ways<parts, 1>(tables, factor, SolveVector<on_chip>{vector}, chip);
  add_second_parts<on_chip>(tables, vector);
}

}  // namespace flash::sim::cuda
