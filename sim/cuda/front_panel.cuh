#pragma once
#include "sim/cuda/front_tables.h"
#include "sim/cuda/team.cuh"

namespace flash::sim::cuda {

/// The columns [A11; A21] of a front on chip: its own rows, padded to whole blocks of `panel_width` by those
/// of the identity, then the rows below.
struct Panel {
  float* numbers;
  int columns;    ///< own rows and columns
  int own;        ///< padded
  int below;      ///< rows below
  int leading;    ///< panel_leading
  Group group;

  __device__ int height() const { return own + below; }
  __device__ float& at(int row, int column) const { return numbers[column * leading + row]; }
  __device__ void set_four(int row, int column, const float4& value) const {
    *reinterpret_cast<float4*>(numbers + column * leading + row) = value;
  }
};

__device__ inline float4 four_at(const float* numbers) { return *reinterpret_cast<const float4*>(numbers); }
__device__ inline float2 two_at(const float* numbers) { return *reinterpret_cast<const float2*>(numbers); }

/// Where the rows of a front stand in the update matrices of its children, on chip: a place and an offset add
/// up to where a number is in the memory of updates. That begins with zeros, for columns that a child lacks.
struct ChildRows {
  int *places, *offsets;  ///< of one child after the other (FrontPlan::panel_rows)
  int stride;
  bool any;  ///< whether there is a child

  __device__ int place(int child, int row) const { return places[child * stride + row]; }

  /// Whether the child has any of `count` columns from `first` on: whole warps.
  template <int count>
  __device__ bool has_columns(int child, int first) const {
    return __any_sync(0xffffffffu, offsets[child * stride + first + lane() % count] != 0);
  }

  /// work(j, where) for columns from `first` on: where their numbers of the row at `place` are, if it is there.
  template <int count, typename Work>
  __device__ void for_columns(const float* updates, int child, int place, int first, const Work& work) const {
    const int* columns = offsets + child * stride + first;
    const float* from = kept_whole(updates + max(place, 0));
#pragma unroll
    for (int j = 0; j < count; j += 4) {
      const int4 four = *reinterpret_cast<const int4*>(columns + j);
      work(j, from + four.x);
      work(j + 1, from + four.y);
      work(j + 2, from + four.z);
      work(j + 3, from + four.w);
    }
  }
};

/// Fills in the rows of a front.
__device__ inline void load_rows(const FrontTables& tables, const FrontLayout& front, const Group& group,
                                 const ChildRows& rows) {
  const int4* from = reinterpret_cast<const int4*>(tables.panel_rows + front.first_panel_row);
  int4* to = reinterpret_cast<int4*>(rows.places);
  for (int i = group.rank; i < rows.stride; i += group.size) to[i] = from[i];
}

/// Zeros, and the identity in the padding.
__device__ inline void clear_columns(const Panel& panel) {
  float4* to = reinterpret_cast<float4*>(panel.numbers);
  for (int i = panel.group.rank; i < panel.own * panel.leading / 4; i += panel.group.size) to[i] = {0, 0, 0, 0};
  panel.group.synchronize();
  for (int i = panel.columns + panel.group.rank; i < panel.own; i += panel.group.size) panel.at(i, i) = 1;
}

/// What the children pass up to the columns of a panel; zeros above the diagonal, the identity in the padding.
/// The first child's numbers are copied to their places while the second's, which are added, are on their way.
__device__ inline void gather_columns(const Panel& panel, const ChildRows& rows, const float* updates) {
  constexpr int together = 3;  // blocks of columns whose numbers are on their way to be added
  const int strips = (panel.height() + 31) / 32, blocks = panel.own / panel_width;
  const int own_warp = panel.group.rank / 32, warps = panel.group.size / 32;
  // A warp takes some of the blocks of each strip.
  const int first_block = own_warp % blocks, step = max(min(warps, blocks), 1);
  const int first_strip = own_warp / blocks, strip_step = max(warps / blocks, 1);
  if (own_warp >= step * strip_step) return;
  for (int strip = first_strip; strip < strips; strip += strip_step) {
    const int row = 32 * strip + lane();
    if (row >= panel.height()) break;
    const int place = rows.place(0, row);
    for (int block = first_block; block < blocks; block += step) {
      const int first = panel_width * block;
      float* to = &panel.at(row, first);
      rows.for_columns<panel_width>(updates, 0, place, first, [&](int j, const float* from) {
        const bool unit = row == first + j && row >= panel.columns;
        if (unit)
          to[j * panel.leading] = 1;
        else
          copy_later(to + j * panel.leading, from, place >= 0 && row >= first + j);
      });
    }
  }
  for (int strip = first_strip; strip < strips; strip += strip_step) {
    const int row = 32 * strip + lane(), place = row < panel.height() ? rows.place(1, row) : -1;
    for (int base = first_block; base < blocks; base += together * step) {
      float numbers[together][panel_width];
      bool there[together];
#pragma unroll
      for (int b = 0; b < together; ++b) {
        const int block = min(base + b * step, blocks - 1), first = panel_width * block;
        there[b] = rows.has_columns<panel_width>(1, first) && place >= 0 && base + b * step < blocks;
        if (there[b])
          rows.for_columns<panel_width>(updates, 1, place, first,
                                        [&](int j, const float* from) { numbers[b][j] = *from; });
      }
      wait_for_copies();
#pragma unroll
      for (int b = 0; b < together; ++b) {
        if (!there[b]) continue;
        const int first = panel_width * (base + b * step);
        float* to = &panel.at(row, first);
#pragma unroll
        for (int j = 0; j < panel_width; ++j)
          if (row >= first + j) to[j * panel.leading] += numbers[b][j];
      }
    }
  }
  wait_for_copies();
}

/// Blocks of the matrix on their way to a panel: columns of a block, a few each thread.
struct BlockBatch {
  static constexpr int size = 4;
  BlockPlace places[size];
  float numbers[size][3];

  __device__ void load(const FrontTables& tables, const FrontLayout& front, const float* __restrict__ blocks,
                       int base, int step) {
    const int count = 3 * front.block_count;
#pragma unroll
    for (int i = 0; i < size; ++i)
      places[i] = tables.blocks[front.first_block + min(base + i * step, count - 1) / 3];
#pragma unroll
    for (int i = 0; i < size; ++i) {
      const int c = min(base + i * step, count - 1) % 3;
      const float* from = blocks + 9 * places[i].source + (places[i].transposed ? c : 3 * c);
      const int apart = places[i].transposed ? 3 : 1;
#pragma unroll
      for (int r = 0; r < 3; ++r) numbers[i][r] = from[r * apart];
    }
  }
  __device__ void add(const FrontLayout& front, const Panel& panel, int base, int step) const {
#pragma unroll
    for (int i = 0; i < size; ++i) {
      const int e = base + i * step, column = 3 * places[i].column + e % 3;
      if (e >= 3 * front.block_count) continue;
      const int below = places[i].row - front.column_count,
                row = below < 0 ? 3 * places[i].row : panel.own + 3 * below;
#pragma unroll
      for (int r = 0; r < 3; ++r)
        if (row + r >= column) panel.at(row + r, column) += numbers[i][r];
    }
  }
};

}  // namespace flash::sim::cuda
