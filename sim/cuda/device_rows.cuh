#pragma once
#include <type_traits>

#include "sim/cuda/chip_memory.cuh"
#include "sim/cuda/four.h"
#include "sim/cuda/layout/edge_sources.h"
#include "sim/cuda/sheet_tables.h"
#include "sim/cuda/team.cuh"

namespace flash::sim::cuda {

// The scalar rows by warps (scalar_rows.cuh).

/// Writes nine numbers of the lane's vertex to a block of its slice, through 9 * 32 numbers of the warp on
/// chip: so a warp writes whole lines.
__device__ inline void write_slice_block(const float (&block)[9], int, float* slice, float* chip) {
  static_assert(slice_size == warp_lanes);
  synchronize_warp();
#pragma unroll
  for (int e = 0; e < 9; ++e) chip[3 * slice_size * (e / 3) + 3 * lane() + e % 3] = block[e];
  synchronize_warp();
  float* to = slice + lane();
#pragma unroll
  for (int e = 0; e < 9; ++e) to[32 * e] = chip[32 * e + lane()];
}

/// What a lane has of a few steps that follow each other, `together` of them.
template <typename Number>
struct StepNumbers {
  /// As many of either precision as leave room for those of the next steps in registers.
  static constexpr int together = std::is_same_v<Number, float> ? steps_together : steps_together / 2;

  Four<Number> rows[together];
  unsigned columns[together / 2];  ///< two each

  __device__ int column(int k) const { return static_cast<int>(columns[k / 2] >> 16 * (k % 2) & 0xffff); }
};

/// Where the columns of a lane in `together` steps from `step` on are.
template <int together>
__device__ const char* columns_at(const SheetTables& tables, int step) {
  return reinterpret_cast<const char*>(tables.step_columns + 32 * (step / steps_together) + lane()) +
         step % steps_together / together * (2 * together);
}

/// Steps that come from memory to registers, those of the next steps during the present ones.
template <typename Number>
struct StepsInMemory {
  const Number* values;

  __device__ StepNumbers<Number> load(const SheetTables& tables, int first) const {
    constexpr int together = StepNumbers<Number>::together;
    StepNumbers<Number> numbers;
#pragma unroll
    for (int k = 0; k < together; ++k) {
      if constexpr (std::is_same_v<Number, float>) {
        numbers.rows[k] = reinterpret_cast<const Four<float>*>(values)[32L * (first + k) + lane()];
      } else {
        const double2* of_step = reinterpret_cast<const double2*>(values) + 64L * (first + k);
        const double2 upper = of_step[lane()], lower = of_step[32 + lane()];
        numbers.rows[k] = {upper.x, upper.y, lower.x, lower.y};
      }
    }
    const unsigned* columns = reinterpret_cast<const unsigned*>(columns_at<together>(tables, first));
#pragma unroll
    for (int k = 0; k < together / 2; ++k) numbers.columns[k] = columns[k];
    return numbers;
  }
  /// use(numbers) for the steps from `start` to `end`.
  template <typename Use>
  __device__ void run(const SheetTables& tables, int start, int end, const Use& use) const {
    constexpr int together = StepNumbers<Number>::together;
    StepNumbers<Number> now = load(tables, start);
    for (int step = start; step < end; step += together) {
      // Behind the last ones they are not used.
      const StepNumbers<Number> next = load(tables, min(step + together, end - together));
      use(now);
      now = next;
    }
  }
};

/// On-chip memory of a block for steps on their way, `depth` times a few of them for each warp.
struct StepRing {
  char* chip = nullptr;
  int depth = 0;  ///< 0: none
};
inline constexpr int step_ring_bytes = block_warps * steps_together * 32 * (4 * 4 + 2);  ///< a depth of one
inline constexpr int least_step_depth = 2, most_step_depth = 4;

/// Steps that come to the chip in the background, ahead of their use: those of all bundles of a warp, one
/// after the other. Each lane reads what it has sent for itself.
template <typename Number>
class StepsOnTheirWay {
 public:
  __device__ StepsOnTheirWay(const SheetTables& tables, const Number* values, const StepRing& ring)
      : values_(reinterpret_cast<const char*>(values) + 16 * lane()),
        depth_(ring.depth),
        first_(chip_address(ring.chip) + warp() * ring.depth * group_bytes),
        end_(first_ + ring.depth * group_bytes),
        at_(first_),
        bundle_(team_warp()) {
    begin_bundle(tables);
    for (int k = 0; k < depth_; ++k) send(tables);
  }

  __device__ bool are_sent() const { return depth_ > 0; }

  /// As StepsInMemory, for one bundle of the warp after the other.
  template <typename Use>
  __device__ void run(const SheetTables& tables, int start, int end, const Use& use) {
    for (int step = start; step < end; step += together) {
      if (depth_ == 4)
        wait_for_copies<3>();
      else if (depth_ == 3)
        wait_for_copies<2>();
      else
        wait_for_copies<1>();
      StepNumbers<Number> now;
      int4 pieces[4];
#pragma unroll
      for (int k = 0; k < 4; ++k) pieces[k] = load_int4(at_ + 512 * k + 16 * lane());
#pragma unroll
      for (int k = 0; k < together; ++k) now.rows[k] = four_of(pieces + 4 / together * k, Number{});
      const unsigned columns = at_ + 4 * 512 + 2 * together * lane();
#pragma unroll
      for (int k = 0; k < together / 2; ++k)
        now.columns[k] = static_cast<unsigned>(load_int(columns + 4 * k));
      use(now);
      send(tables);
    }
  }

 private:
  static constexpr int together = StepNumbers<Number>::together;
  static constexpr int group_bytes = step_ring_bytes / block_warps;
  static_assert(together * sizeof(Four<Number>) == 4 * 16 && steps_together == 4);

  __device__ static Four<float> four_of(const int4* piece, float) {
    return {__int_as_float(piece->x), __int_as_float(piece->y), __int_as_float(piece->z),
            __int_as_float(piece->w)};
  }
  __device__ static Four<double> four_of(const int4* pieces, double) {
    return {__hiloint2double(pieces[0].y, pieces[0].x), __hiloint2double(pieces[0].w, pieces[0].z),
            __hiloint2double(pieces[1].y, pieces[1].x), __hiloint2double(pieces[1].w, pieces[1].z)};
  }

  __device__ void begin_bundle(const SheetTables& tables) {
    if (bundle_ >= tables.bundle_count) return;
    next_ = tables.bundle_starts[bundle_];
    bundle_end_ = tables.bundle_starts[bundle_ + 1];
  }
  /// Sends the next steps to the place that is free; behind the last ones nothing.
  __device__ void send(const SheetTables& tables) {
    if (bundle_ < tables.bundle_count) {
      const char* from = values_ + 32L * sizeof(Four<Number>) * next_;
#pragma unroll
      for (int k = 0; k < 4; ++k) copy_to_chip<16>(at_ + 512 * k + 16 * lane(), from + 512 * k);
      copy_to_chip<2 * together>(at_ + 4 * 512 + 2 * together * lane(), columns_at<together>(tables, next_));
      next_ += together;
      if (next_ >= bundle_end_) {
        bundle_ += team_warps();
        begin_bundle(tables);
      }
    }
    end_copies();
    at_ += group_bytes;
    if (at_ == end_) at_ = first_;
  }

  const char* values_;
  int depth_;
  unsigned first_, end_, at_;
  int bundle_, next_ = 0, bundle_end_ = 0;
};

/// S x over the vertices: x(vertex) has x, y and z, and write(row, c, number) takes coordinate c of a row. S,
/// shared by all environments, comes from the second-level cache, its steps from `source`; four lanes share
/// the columns of a group of four rows.
template <typename Number, typename Source, typename Places, typename Write>
__device__ void multiply_scalar_rows(const SheetTables& tables, Source&& source, const Places& x,
                                     const Write& write) {
  static_assert(4 * bundle_groups == 32);
  for (int i = team_rank(); i < 3 * tables.size && tables.bundle_count == 0; i += team_size())
    write(i / 3, i % 3, Number{});
  for (int bundle = team_warp(); bundle < tables.bundle_count; bundle += team_warps()) {
    Number sums[4][3] = {};
    source.run(tables, tables.bundle_starts[bundle], tables.bundle_starts[bundle + 1],
               [&](const StepNumbers<Number>& now) {
#pragma unroll
                 for (int k = 0; k < now.together; ++k) {
                   const auto vertex = x(now.column(k));
                   const Four<Number> own = now.rows[k];
                   const Number rows[4] = {own.x, own.y, own.z, own.w};
#pragma unroll
                   for (int row = 0; row < 4; ++row) {
                     sums[row][0] += rows[row] * vertex.x;
                     sums[row][1] += rows[row] * vertex.y;
                     sums[row][2] += rows[row] * vertex.z;
                   }
                 }
               });
    Number own[3] = {};
#pragma unroll
    for (int row = 0; row < 4; ++row)
#pragma unroll
      for (int c = 0; c < 3; ++c) {
        Number sum = sums[row][c];
        sum += __shfl_xor_sync(0xffffffffu, sum, 1);
        sum += __shfl_xor_sync(0xffffffffu, sum, 2);
        if (row == lane() % 4) own[c] = sum;
      }
    const int row = tables.group_rows[32 * bundle + lane()];
    if (row >= 0)
      for (int c = 0; c < 3; ++c) write(row, c, own[c]);
  }
}

}  // namespace flash::sim::cuda
