#pragma once
#include <cuda_pipeline.h>

#include "sim/cuda/front_tables.h"
#include "sim/cuda/stored.cuh"
#include "sim/cuda/team.cuh"

namespace flash::sim::cuda {

// Solves with the factor of front_factor.cuh. A front's columns W = [L11^-1; -L21 L11^-1] serve both ways:
// forward its own numbers b become [y; u] = W b, u passed up; backward x = W^T [y; x_below]. So the operator
// is F^T F whatever the rounding of W: symmetric and positive definite, as conjugate gradients need it. One
// barrier a level each way; the factor is read twice. It comes from memory by chunks, the next of each
// warp on its way to the chip while it works on one.

/// A chunk on chip: numbers, what SolveChunk::table_at says, and the chunk itself [bytes].
inline constexpr int chunk_table_bytes = 4 * chunk_rows;
static_assert(static_cast<int>(sizeof(Gather)) * (column_gathers + row_gathers) <= chunk_table_bytes);
template <typename Stored>
__host__ __device__ constexpr int slot_bytes() {
  return chunk_numbers * static_cast<int>(sizeof(Stored)) + chunk_table_bytes +
         static_cast<int>(sizeof(SolveChunk));
}

/// On-chip bytes that a solve needs: slots, and right-hand sides of each warp's chunk.
template <typename Stored>
__host__ __device__ constexpr int solve_memory(int depth) {
  return team_warps * (depth * slot_bytes<Stored>() + chunk_columns * static_cast<int>(sizeof(float)));
}

/// Three numbers a vertex of one environment: what a solve works on, in any memory.
struct SolveVectors {
  float* forward;  ///< 6 a vertex: y of the forward solve, then right-hand side and solution
  float* passed;   ///< FrontTables::vector_size
};

/// 64 bytes that all lanes read.
__device__ inline SolveChunk load_chunk(const SolveChunk* from) {
  SolveChunk chunk;
#pragma unroll
  for (int k = 0; k < 4; ++k) reinterpret_cast<int4*>(&chunk)[k] = reinterpret_cast<const int4*>(from)[k];
  return chunk;
}

/// The chunks of a warp, on their way to the chip.
template <typename Stored>
class ChunkStream {
 public:
  __device__ ChunkStream(const FrontTables& tables, const Stored* factor, char* chip)
      : gathers_(tables.gathers),
        entries_(tables.entries),
        depth_(tables.solve_depth),
        factor_(factor),
        slots_(chip + warp() * tables.solve_depth * slot_bytes<Stored>()),
        next_(tables.chunks + tables.chunk_starts[warp()]),
        described_(load_chunk(next_)) {
    if (depth_ > 1) send();
  }

  /// The next chunk, on chip until the next call.
  __device__ const char* take() {
    __syncwarp();
    send();
    if (depth_ > 1)
      __pipeline_wait_prior(1);
    else
      __pipeline_wait_prior(0);
    __syncwarp();
    const char* slot = slots_ + taken_ * slot_bytes<Stored>();
    taken_ = taken_ + 1 == depth_ ? 0 : taken_ + 1;
    return slot;
  }

  /// Nothing is on its way any more.
  __device__ void finish() { __pipeline_wait_prior(0); }

  __device__ static SolveChunk chunk(const char* slot) {
    return load_chunk(reinterpret_cast<const SolveChunk*>(slot + described_at));
  }
  __device__ static const Stored* numbers(const char* slot) { return reinterpret_cast<const Stored*>(slot); }
  template <typename Entry>
  __device__ static const Entry* table(const char* slot) {
    return reinterpret_cast<const Entry*>(slot + table_at);
  }

 private:
  static constexpr int together = 16 / static_cast<int>(sizeof(Stored));  ///< numbers of a copy
  static constexpr int table_at = chunk_numbers * static_cast<int>(sizeof(Stored)),
                       described_at = table_at + chunk_table_bytes;

  /// Behind the last chunk of a warp stand some without numbers.
  __device__ void send() {
    const SolveChunk& c = described_;
    char* slot = slots_ + sent_ * slot_bytes<Stored>();
    sent_ = sent_ + 1 == depth_ ? 0 : sent_ + 1;
    if (lane() == 0)
#pragma unroll
      for (int k = 0; k < 4; ++k)
        reinterpret_cast<int4*>(slot + described_at)[k] = reinterpret_cast<const int4*>(&c)[k];
    // Absent rows and columns become zeros.
    constexpr int copies = chunk_rows / together, side_by_side = 32 / copies;
    const int part = lane() % copies * together, first = lane() / copies;
    const int columns = part < c.rows ? c.columns : 0;
    Stored* to = reinterpret_cast<Stored*>(slot) + first * chunk_rows + part;
    const Stored* from = factor_ + c.panel_at + first * c.leading + part;
#pragma unroll
    for (int k = 0; k < chunk_columns; k += side_by_side)
      __pipeline_memcpy_async(to + k * chunk_rows, from + k * c.leading, 16, first + k < columns ? 0 : 16);
    if (c.flags & SolveChunk::backward) {
      if (4 * lane() < c.rows)
        __pipeline_memcpy_async(slot + table_at + 16 * lane(), entries_ + c.table_at + 4 * lane(), 16);
    } else if (lane() < column_gathers + row_gathers) {
      const int at = lane() < column_gathers ? c.table_at : c.row_table_at - column_gathers;
      __pipeline_memcpy_async(slot + table_at + sizeof(Gather) * lane(), gathers_ + at + lane(),
                              sizeof(Gather));
    }
    __pipeline_commit();
    described_ = load_chunk(++next_);
  }

  const Gather* gathers_;
  const int* entries_;
  int depth_;
  const Stored* factor_;
  char* slots_;
  int sent_ = 0, taken_ = 0;
  const SolveChunk* next_;
  SolveChunk described_;
};

__device__ inline float passed_up(const Gather& gather, int coordinate, const float* passed) {
  float sum = 0;
  if (gather.first >= 0) sum += passed[gather.first + coordinate];
  if (gather.second >= 0) sum += passed[gather.second + coordinate];
  return sum;
}

// Sixteen lanes take four rows of a chunk each, the two halves of a warp half of its columns each.
inline constexpr int half_columns = chunk_columns / 2;
static_assert(chunk_rows == 16 * 4 && chunk_columns <= 32);

/// `sum`: of the chunks of the task so far, of the lane's four rows. `right`: room for chunk_columns numbers.
template <typename Stored>
__device__ void run_forward(const char* slot, const SolveChunk& c, const SolveVectors& v, float* right,
                            float4& sum) {
  constexpr unsigned all = 0xffffffffu;
  const Gather* gathers = ChunkStream<Stored>::template table<Gather>(slot);
  const int row = 4 * (lane() % 16), half = lane() / 16;
  if (lane() < chunk_columns)
    right[lane()] = lane() < c.columns ? v.forward[c.right_at + lane()] +
                                             passed_up(gathers[lane() / 3], lane() % 3, v.passed)
                                       : 0;
  __syncwarp();
  if (c.flags & SolveChunk::begins) sum = {0, 0, 0, 0};
  const Stored* numbers = ChunkStream<Stored>::numbers(slot) + half * half_columns * chunk_rows + row;
#pragma unroll
  for (int first = 0; first < half_columns; first += 4) {
    const float4 four = load_four(right + half * half_columns + first);
    const float x[4] = {four.x, four.y, four.z, four.w};
#pragma unroll
    for (int k = 0; k < 4; ++k) {
      const float4 w = load_four(numbers + (first + k) * chunk_rows);
      sum.x += w.x * x[k];
      sum.y += w.y * x[k];
      sum.z += w.z * x[k];
      sum.w += w.w * x[k];
    }
  }
  if (!(c.flags & SolveChunk::ends)) return;
  // Of its four rows each half keeps two.
  const float kept[2] = {half ? sum.z : sum.x, half ? sum.w : sum.y},
              given[2] = {half ? sum.x : sum.z, half ? sum.y : sum.w};
#pragma unroll
  for (int k = 0; k < 2; ++k) {
    const float result = kept[k] + __shfl_xor_sync(all, given[k], 16);
    const int mine = c.first_row + row + 2 * half + k, below = mine - c.below_at;
    if (row >= c.rows) continue;
    if (mine < c.own_columns) {
      v.forward[c.y_at + mine] = result;
    } else if (below >= 0 && below < c.below_count) {
      const int begin = max(0, c.first_row - c.below_at) / 3;
      v.passed[c.passed_at + below] =
          result + passed_up(gathers[column_gathers + below / 3 - begin], below % 3, v.passed);
    }
  }
}

/// `sums`: of the chunks of the task so far, of the lane's rows in its half of the columns.
template <typename Stored>
__device__ void run_backward(const char* slot, const SolveChunk& c, const SolveVectors& v,
                             float (&sums)[half_columns]) {
  constexpr unsigned all = 0xffffffffu;
  static_assert(half_columns == 12);
  if (c.flags & SolveChunk::begins)
#pragma unroll
    for (float& sum : sums) sum = 0;
  const int row = 4 * (lane() % 16), half = lane() / 16;
  if (row < c.rows) {
    const int4 entry = ChunkStream<Stored>::template table<int4>(slot)[lane() % 16];
    const float4 x = {v.forward[entry.x], v.forward[entry.y], v.forward[entry.z], v.forward[entry.w]};
    const Stored* numbers = ChunkStream<Stored>::numbers(slot) + half * half_columns * chunk_rows + row;
#pragma unroll
    for (int k = 0; k < half_columns; ++k) {
      const float4 w = load_four(numbers + k * chunk_rows);
      sums[k] += (w.x * x.x + w.y * x.y) + (w.z * x.z + w.w * x.w);
    }
  }
  if (!(c.flags & SolveChunk::ends)) return;
    // Halves of the sixteen lanes take halves of the columns: six, three, then two or one; the rest adds up.
#pragma unroll
  for (int kept = 6, bit = 8; kept >= 3; kept /= 2, bit /= 2) {
    const bool upper = lane() & bit;
#pragma unroll
    for (int k = 0; k < kept; ++k) {
      const float given = upper ? sums[k] : sums[k + kept], own = upper ? sums[k + kept] : sums[k];
      sums[k] = own + __shfl_xor_sync(all, given, bit);
    }
  }
  const bool last = lane() & 2;
  const float first = __shfl_xor_sync(all, last ? sums[0] : sums[2], 2),
              second = __shfl_xor_sync(all, sums[1], 2);
  float a = (last ? sums[2] : sums[0]) + first, b = sums[1] + second;
  a += __shfl_xor_sync(all, a, 1);
  b += __shfl_xor_sync(all, b, 1);
  const int column = half * half_columns + (lane() & 8 ? 6 : 0) + (lane() & 4 ? 3 : 0) + (last ? 2 : 0);
  if (lane() % 2 != 0) return;
  if (column < c.columns) v.forward[c.right_at + column] = a;
  if (!last && column + 1 < c.columns) v.forward[c.right_at + column + 1] = b;
}

/// x <- (L L^T)^-1 x, x behind the first 3 a vertex of `forward`. `chip`: solve_memory.
template <typename Stored>
__device__ void solve(const FrontTables& tables, const Stored* factor, const SolveVectors& v, char* chip) {
  ChunkStream<Stored> stream(tables, factor, chip);
  float* right = reinterpret_cast<float*>(chip + team_warps * tables.solve_depth * slot_bytes<Stored>()) +
                 warp() * chunk_columns;
  float4 sum = {0, 0, 0, 0};
  for (int l = 0; l < tables.level_count; ++l) {
    __syncthreads();
    for (bool more = true; more;) {
      const char* slot = stream.take();
      const SolveChunk chunk = ChunkStream<Stored>::chunk(slot);
      if (chunk.columns > 0) run_forward<Stored>(slot, chunk, v, right, sum);
      more = !(chunk.flags & SolveChunk::ends_level);
    }
  }
  float sums[half_columns] = {};
  for (int l = 0; l < tables.level_count; ++l) {
    __syncthreads();
    for (bool more = true; more;) {
      const char* slot = stream.take();
      const SolveChunk chunk = ChunkStream<Stored>::chunk(slot);
      if (chunk.columns > 0) run_backward<Stored>(slot, chunk, v, sums);
      more = !(chunk.flags & SolveChunk::ends_level);
    }
  }
  stream.finish();
  __syncthreads();
}

}  // namespace flash::sim::cuda
