#pragma once
#include <cuda_pipeline.h>

#include "sim/cuda/front_tables.h"
#include "sim/cuda/stored.cuh"
#include "sim/cuda/team.cuh"

namespace flash::sim::cuda {

// Solves with the factor of front_factor.cuh. A front's columns W = [L11^-1; -L21 L11^-1] serve both ways:
// forward its own numbers b become [y; u] = W b, u passed up; backward x = W^T [y; x_below]. So the operator
// is F^T F whatever the rounding of W: symmetric and positive definite, as conjugate gradients need it. One
// barrier a level each way; the factor is read twice. It comes from memory by chunks, several of each warp on
// their way to the chip at a time, so that a warp hardly ever waits for it.

/// Chunks of a warp that are on their way or worked on.
inline constexpr int solve_depth = 5;

/// A chunk on chip: numbers, what SolveChunk::table_at says, and the chunk itself [bytes].
inline constexpr int chunk_table_bytes = 4 * chunk_rows, forward_row_gathers = (forward_rows + 4) / 3;
static_assert(static_cast<int>(sizeof(Gather)) * (chunk_columns / 3 + forward_row_gathers) <= chunk_table_bytes);
template <typename Stored>
__host__ __device__ constexpr int slot_bytes() {
  return chunk_numbers * static_cast<int>(sizeof(Stored)) + chunk_table_bytes +
         static_cast<int>(sizeof(SolveChunk));
}

/// On-chip bytes that a solve needs.
template <typename Stored>
__host__ __device__ constexpr int solve_memory() {
  return team_warps * solve_depth * slot_bytes<Stored>();
}

/// Three numbers a vertex of one environment: what a solve works on, in any memory.
struct SolveVectors {
  float* forward;  ///< 6 a vertex: y of the forward solve, then right-hand side and solution
  float* passed;   ///< FrontTables::vector_size
};

/// The chunks of a warp, on their way to the chip.
template <typename Stored>
class ChunkStream {
 public:
  __device__ ChunkStream(const FrontTables& tables, const Stored* factor, char* chip)
      : tables_(tables),
        factor_(factor),
        slots_(chip + warp() * solve_depth * slot_bytes<Stored>()),
        next_(tables.chunk_starts[warp()]),
        end_(tables.chunk_starts[warp() + 1]) {
    load_next();
    for (int k = 0; k + 1 < solve_depth; ++k) send();
  }

  /// The next chunk, on chip until the call after the next.
  __device__ const char* take() {
    __syncwarp();
    send();
    __pipeline_wait_prior(solve_depth - 1);
    __syncwarp();
    const char* slot = slots_ + taken_ * slot_bytes<Stored>();
    taken_ = taken_ + 1 == solve_depth ? 0 : taken_ + 1;
    return slot;
  }

  __device__ static const SolveChunk& chunk(const char* slot) {
    return *reinterpret_cast<const SolveChunk*>(slot + slot_bytes<Stored>() - sizeof(SolveChunk));
  }
  __device__ static const Stored* numbers(const char* slot) { return reinterpret_cast<const Stored*>(slot); }
  template <typename Entry>
  __device__ static const Entry* table(const char* slot) {
    return reinterpret_cast<const Entry*>(slot + chunk_numbers * sizeof(Stored));
  }

 private:
  static constexpr int together = 16 / static_cast<int>(sizeof(Stored));  ///< numbers of a copy

  /// Four lanes have a quarter of the next chunk's description each.
  __device__ void load_next() {
    if (next_ < end_ && lane() < 4) described_ = reinterpret_cast<const int4*>(tables_.chunks + next_)[lane()];
  }

  __device__ void send() {
    if (next_ < end_) {
      char* slot = slots_ + sent_ * slot_bytes<Stored>();
      sent_ = sent_ + 1 == solve_depth ? 0 : sent_ + 1;
      if (lane() < 4)
        reinterpret_cast<int4*>(slot + slot_bytes<Stored>() - sizeof(SolveChunk))[lane()] = described_;
      ++next_;
      load_next();
      __syncwarp();
      const SolveChunk& c = chunk(slot);
      Stored* to = reinterpret_cast<Stored*>(slot);
      char* table = slot + chunk_numbers * sizeof(Stored);
      const Stored* from = factor_ + c.panel_at;
      if (c.flags & SolveChunk::backward) {
        const int copies = c.rows / together, step = 32 / backward_columns;
        const int column = lane() / step;
        if (column < c.columns)
          for (int k = lane() % step; k < copies; k += step)
            __pipeline_memcpy_async(to + column * chunk_rows + k * together,
                                    from + static_cast<long>(column) * c.leading + k * together, 16);
        if (4 * lane() < c.rows)
          __pipeline_memcpy_async(table + 16 * lane(), tables_.entries + c.table_at + 4 * lane(), 16);
      } else {
        constexpr int copies = forward_rows / together;
        for (int k = lane(); k < copies * c.columns; k += 32) {
          const int column = k / copies, part = k % copies;
          __pipeline_memcpy_async(to + column * forward_rows + part * together,
                                  from + static_cast<long>(column) * c.leading + part * together, 16);
        }
        constexpr int own = chunk_columns / 3;
        const int count = c.rows > 0 ? own + forward_row_gathers : 0;
        if (lane() < count) {
          const int at = lane() < own ? c.table_at + lane() : c.row_table_at + lane() - own;
          __pipeline_memcpy_async(table + sizeof(Gather) * lane(), tables_.gathers + at, sizeof(Gather));
        }
      }
    }
    __pipeline_commit();
  }

  const FrontTables& tables_;
  const Stored* factor_;
  char* slots_;
  int next_, end_, sent_ = 0, taken_ = 0;
  int4 described_ = {};
};

__device__ inline float passed_up(const Gather& gather, int coordinate, const float* passed) {
  float sum = 0;
  if (gather.first >= 0) sum += passed[gather.first + coordinate];
  if (gather.second >= 0) sum += passed[gather.second + coordinate];
  return sum;
}

/// Lanes take four rows each, over every eighth column. `sum`: of the chunks of the task so far.
template <typename Stored>
__device__ void run_forward(const char* slot, const SolveVectors& v, float4& sum) {
  constexpr unsigned all = 0xffffffffu;
  const SolveChunk& c = ChunkStream<Stored>::chunk(slot);
  const Gather* gathers = ChunkStream<Stored>::template table<Gather>(slot);
  const int quad = lane() % 4, first_column = lane() / 4;
  float own = 0;
  if (lane() < c.columns)
    own = v.forward[c.right_at + lane()] + passed_up(gathers[lane() / 3], lane() % 3, v.passed);
  if (c.flags & SolveChunk::begins) sum = {0, 0, 0, 0};
  const Stored* numbers = ChunkStream<Stored>::numbers(slot) + 4 * quad;
#pragma unroll
  for (int j = 0; j < (chunk_columns + 7) / 8; ++j) {
    const int k = first_column + 8 * j;
    const float x = __shfl_sync(all, own, k);
    if (k >= c.columns) continue;
    const float4 w = load_four(numbers + k * forward_rows);
    sum.x += w.x * x;
    sum.y += w.y * x;
    sum.z += w.z * x;
    sum.w += w.w * x;
  }
  if (!(c.flags & SolveChunk::ends)) return;
  // Halves of the lanes keep half of the rows, then one of four; then the rest adds up.
  const bool upper = first_column & 1, last = first_column & 2;
  float a = upper ? sum.z : sum.x, b = upper ? sum.w : sum.y;
  a += __shfl_xor_sync(all, upper ? sum.x : sum.z, 4);
  b += __shfl_xor_sync(all, upper ? sum.y : sum.w, 4);
  float result = last ? b : a;
  result += __shfl_xor_sync(all, last ? a : b, 8);
  result += __shfl_xor_sync(all, result, 16);
  if (first_column >= 4) return;
  const int mine = c.first_row + 4 * quad + 2 * upper + last, below = mine - c.below_at;
  if (mine < c.own_columns) {
    v.forward[c.y_at + mine] = result;
  } else if (below >= 0 && below < c.below_count) {
    const int begin = max(0, c.first_row - c.below_at) / 3;
    v.passed[c.passed_at + below] =
        result + passed_up(gathers[chunk_columns / 3 + below / 3 - begin], below % 3, v.passed);
  }
}

/// Lanes take four rows each, over all of the chunk's columns, whose sums they keep.
template <typename Stored>
__device__ void run_backward(const char* slot, const SolveVectors& v, float (&sums)[backward_columns]) {
  const SolveChunk& c = ChunkStream<Stored>::chunk(slot);
  if (c.flags & SolveChunk::begins)
#pragma unroll
    for (float& sum : sums) sum = 0;
  const int row = 4 * (lane() % 16), half = lane() / 16;
  if (row < c.rows) {
    const int4 entry = ChunkStream<Stored>::template table<int4>(slot)[lane() % 16];
    const float4 x = {v.forward[entry.x], v.forward[entry.y], v.forward[entry.z], v.forward[entry.w]};
    const Stored* numbers = ChunkStream<Stored>::numbers(slot) + row;
#pragma unroll
    for (int k = 0; k < backward_columns / 2; ++k) {
      const int column = 2 * k + half;
      if (column >= c.columns) continue;
      const float4 w = load_four(numbers + column * chunk_rows);
      sums[k] += (w.x * x.x + w.y * x.y) + (w.z * x.z + w.w * x.w);
    }
  }
  if (!(c.flags & SolveChunk::ends)) return;
  // Halves of the sixteen lanes take halves of the columns, until each has one; then the rest adds up.
#pragma unroll
  for (int kept = backward_columns / 4, bit = 8; kept > 0; kept /= 2, bit /= 2) {
    const bool upper = lane() & bit;
#pragma unroll
    for (int k = 0; k < kept; ++k) {
      const float given = upper ? sums[k] : sums[k + kept], own = upper ? sums[k + kept] : sums[k];
      sums[k] = own + __shfl_xor_sync(0xffffffffu, given, bit);
    }
  }
  sums[0] += __shfl_xor_sync(0xffffffffu, sums[0], 2);
  sums[0] += __shfl_xor_sync(0xffffffffu, sums[0], 1);
  const int column = 2 * (lane() % 16 / 4) + half;
  if (lane() % 4 == 0 && column < c.columns) v.forward[c.right_at + column] = sums[0];
}

/// x <- (L L^T)^-1 x, x behind the first 3 a vertex of `forward`. `chip`: solve_memory.
template <typename Stored>
__device__ void solve(const FrontTables& tables, const Stored* factor, const SolveVectors& v, char* chip) {
  ChunkStream<Stored> stream(tables, factor, chip);
  float4 sum = {0, 0, 0, 0};
  for (int l = 0; l < tables.level_count; ++l) {
    __syncthreads();
    for (bool more = true; more;) {
      const char* slot = stream.take();
      const SolveChunk& chunk = ChunkStream<Stored>::chunk(slot);
      if (chunk.columns > 0) run_forward<Stored>(slot, v, sum);
      more = !(chunk.flags & SolveChunk::ends_level);
    }
  }
  float sums[backward_columns] = {};
  for (int l = 0; l < tables.level_count; ++l) {
    __syncthreads();
    for (bool more = true; more;) {
      const char* slot = stream.take();
      const SolveChunk& chunk = ChunkStream<Stored>::chunk(slot);
      if (chunk.columns > 0) run_backward<Stored>(slot, v, sums);
      more = !(chunk.flags & SolveChunk::ends_level);
    }
  }
  __syncthreads();
}

}  // namespace flash::sim::cuda
