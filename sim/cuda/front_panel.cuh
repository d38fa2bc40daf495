#pragma once
#include "sim/cuda/front_tables.h"
#include "sim/cuda/team.cuh"

namespace flash::sim::cuda {

/// The columns [A11; A21] of a front on chip: its own rows, padded to whole blocks of `panel_width` by those
/// of the identity, then the rows below.
struct Panel {
  float* numbers;
  int columns;  ///< own rows and columns
  int own;      ///< padded
  int below;    ///< rows below
  int leading;  ///< panel_leading
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

  /// Of one child, the numbers of a row each lane, at `place`, in columns from `first` on: whole warps.
  template <int count>
  __device__ void gather(const float* updates, int child, int place, int first,
                         float (&numbers)[count]) const {
    const int* columns = offsets + child * stride + first;
#pragma unroll
    for (int j = 0; j < count; ++j) numbers[j] = 0;
    if (!__any_sync(0xffffffffu, columns[lane() % count] != 0) || place < 0) return;
    const float* from = kept_whole(updates + place);
#pragma unroll
    for (int j = 0; j < count; j += 4) {
      const int4 four = *reinterpret_cast<const int4*>(columns + j);
      numbers[j] = from[four.x];
      numbers[j + 1] = from[four.y];
      numbers[j + 2] = from[four.z];
      numbers[j + 3] = from[four.w];
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
  for (int i = panel.group.rank; i < panel.own * panel.leading / 4; i += panel.group.size)
    to[i] = {0, 0, 0, 0};
  panel.group.synchronize();
  for (int i = panel.columns + panel.group.rank; i < panel.own; i += panel.group.size) panel.at(i, i) = 1;
}

/// What the children pass up to the columns of a panel; zeros above the diagonal, the identity in the
/// padding.
__device__ inline void gather_columns(const Panel& panel, const ChildRows& rows, const float* updates) {
  constexpr int together = 2;  // blocks of columns whose numbers are on their way
  const int height = panel.height();
  for (int strip = panel.group.rank / 32; 32 * strip < height; strip += panel.group.size / 32) {
    const int row = 32 * strip + lane();
    const bool there = row < height;
    const int places[2] = {there ? rows.place(0, row) : -1, there ? rows.place(1, row) : -1};
    for (int base = 0; base < panel.own; base += together * panel_width) {
      float numbers[together][2][panel_width];
#pragma unroll
      for (int b = 0; b < together; ++b) {
        const int first = min(base + b * panel_width, panel.own - panel_width);
        rows.gather(updates, 0, places[0], first, numbers[b][0]);
        rows.gather(updates, 1, places[1], first, numbers[b][1]);
      }
#pragma unroll
      for (int b = 0; b < together; ++b) {
        const int first = base + b * panel_width;
        float* to = &panel.at(row, first);
#pragma unroll
        for (int j = 0; j < panel_width; ++j) {
          float sum = numbers[b][0][j] + numbers[b][1][j];
          if (row < first + j) sum = 0;
          if (row == first + j && row >= panel.columns) sum = 1;
          if (there && first < panel.own) to[j * panel.leading] = sum;
        }
      }
    }
  }
}

/// Adds the blocks of the matrix, a column of a block each thread, a few of them at a time.
__device__ inline void add_blocks(const FrontTables& tables, const FrontLayout& front, const float* blocks,
                                  const Panel& panel) {
  constexpr int together = 4;
  const int count = 3 * front.block_count;
  for (int base = panel.group.rank; base < count; base += together * panel.group.size) {
    BlockPlace places[together];
    float numbers[together][3];
#pragma unroll
    for (int i = 0; i < together; ++i)
      places[i] = tables.blocks[front.first_block + min(base + i * panel.group.size, count - 1) / 3];
#pragma unroll
    for (int i = 0; i < together; ++i) {
      const int c = min(base + i * panel.group.size, count - 1) % 3;
      const float* from = blocks + 9 * places[i].source + (places[i].transposed ? c : 3 * c);
      const int step = places[i].transposed ? 3 : 1;
#pragma unroll
      for (int r = 0; r < 3; ++r) numbers[i][r] = from[r * step];
    }
#pragma unroll
    for (int i = 0; i < together; ++i) {
      const int e = base + i * panel.group.size, column = 3 * places[i].column + e % 3;
      const int below = places[i].row - front.column_count,
                row = below < 0 ? 3 * places[i].row : panel.own + 3 * below;
#pragma unroll
      for (int r = 0; r < 3; ++r)
        if (e < count && row + r >= column) panel.at(row + r, column) += numbers[i][r];
    }
  }
}

}  // namespace flash::sim::cuda
