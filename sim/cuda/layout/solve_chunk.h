#pragma once
#include "sim/cuda/layout/front_layout.h"

namespace flash::sim::cuda {

// Plain numbers, laid out on the host and read by kernels as they are. A solve works on one vector: y of the
// forward solve, three numbers a vertex; right-hand side and solution, as many; a zero; what fronts pass up;
// second parts of results.

/// Inputs and results of a chunk at most: two tiles of the factor each.
inline constexpr int chunk_width = 2 * solve_tile_width;
static_assert(chunk_width == 32);  // one each lane of a warp

/// A piece of a front's columns W that a warp multiplies by, with all that it needs to know of it: forward
/// its columns are the inputs and its rows the results, backward the other way round.
struct alignas(16) SolveChunk {
  enum {
    ends = 1,
    ends_level = 2,
    next_is_shared = 4,  ///< with ends_level: blocks of the team need of each other what they have, in the
                         ///< next level, or behind the last one
    own_to_all = 8,      ///< results that stay in the front go to all blocks of the team
    passed_to_all = 16   ///< those that it passes up do
  };

  // To have it sent to the chip.
  int first_tile = 0;   ///< of the factor
  int rows = 0;         ///< chunk_rows: from there to the tile below it, and what of the tiles is not zero;
                        ///< nothing of them where there is nothing to do
  int columns = 0;      ///< chunk_columns: how many tiles side by side, and where results go
  int input_table = 0;  ///< place of the first input in SolvePlan::gathers
  // To multiply by it.
  int flags = 0;
  int inputs = 0;    ///< 0: nothing to do
  int right_at = 0;  ///< forward, of the first input: its right-hand side
  // At the end of a task.
  int own_at = 0, own_count = 0;  ///< results that stay in the front: where the first goes, and how many
  int passed_at = 0;              ///< where the first result would be in what the front passes up
  int passed_begin = 0, passed_end = 0;  ///< results that it does pass up
};
static_assert(sizeof(SolveChunk) == 48);

/// Squares of eight rows and columns of a tile, as they lie behind each other (solve_tile.cuh).
inline constexpr int tile_squares = 4;

/// From the first tile of a chunk to that below it, 0 where none is read, and, a bit each, the squares that
/// hold numbers: of the first tile, of that beside it, of that below it, and of the last. The others are zero
/// and need not be read.
constexpr int chunk_rows(int next_row, int squares) {
  return next_row | static_cast<int>(static_cast<unsigned>(squares) << 16);
}
FLASH_HOST_DEVICE constexpr int next_row_of(int chunk_rows) { return chunk_rows & 0xffff; }
FLASH_HOST_DEVICE constexpr int squares_of(int chunk_rows) {
  return static_cast<int>(static_cast<unsigned>(chunk_rows) >> 16);
}

/// Whether there are two tiles side by side, and the place of the first result in SolvePlan::gathers, -1 for
/// none.
constexpr int chunk_columns(bool two, int result_table) { return 2 * result_table + (two ? 1 : 0); }

/// Chunks of a warp on chip at most; as many without numbers stand behind its last.
inline constexpr int chunks_ahead = 4;

/// Chunks that a warp works on side by side at most. A level has a multiple of so many of each warp.
inline constexpr int chunks_together = 2;

/// Places of two numbers of the vector that are added up; FrontPlan::nothing_passed for none.
struct alignas(8) Gather {
  int first, second;
};

}  // namespace flash::sim::cuda
