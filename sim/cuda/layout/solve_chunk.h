#pragma once
#include "sim/cuda/layout/front_layout.h"

namespace flash::sim::cuda {

// Plain numbers, laid out on the host and read by kernels as they are.

/// Rows and columns of the factor in a chunk at most, and so its numbers on chip: column after column.
inline constexpr int chunk_rows = 64, chunk_columns = 24, chunk_numbers = chunk_rows * chunk_columns;

/// A piece of a front's columns that a warp works on, with all that it needs to know of it.
struct alignas(16) SolveChunk {
  enum { backward = 1, begins = 2, ends = 4, ends_level = 8 };

  int flags = 0;
  int columns = 0, rows = 0;      ///< 0: nothing to do
  int right_at = 0;               ///< of the right-hand sides of its columns; backward of its results
  int panel_at = 0, leading = 0;  ///< of its first number in the factor; from one column to the next
  int table_at = 0;      ///< forward in `gathers`, of its first column; backward in FrontPlan::entries
  int row_table_at = 0;  ///< forward in `gathers`, of its first row below
  int first_row = 0, own_columns = 0, below_at = 0, below_count = 0;  ///< of the front, forward
  int y_at = 0, passed_at = 0;                                        ///< where results go, forward
  int unused[2] = {};
};
static_assert(sizeof(SolveChunk) == 64);

/// Chunks without numbers behind the last of a warp, which looks so far ahead.
inline constexpr int chunks_ahead = 2;

/// Where what two children pass up for a vertex begins, -1 for none.
struct alignas(8) Gather {
  int first = -1, second = -1;
};

/// Those of a chunk: of its columns, then of its rows below.
inline constexpr int column_gathers = chunk_columns / 3, row_gathers = (chunk_rows + 4) / 3;

}  // namespace flash::sim::cuda
