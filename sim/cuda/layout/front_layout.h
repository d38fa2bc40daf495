#pragma once
#include "sim/law/host_device.h"

namespace flash::sim::cuda {

// Plain numbers, laid out on the host and read by kernels as they are.

/// Threads of a block. A power of two.
inline constexpr int block_threads = 512;
inline constexpr int block_warps = block_threads / 32;
static_assert((block_threads & (block_threads - 1)) == 0);

/// Blocks of a team, which works on one environment, at most: 1, 2, 4 or 8, a processor each.
inline constexpr int most_team_blocks = 8;

/// Blocks that a processor of the device has registers for, at least.
inline constexpr int resident_blocks_each = 1;

/// On-chip memory of a block for what its threads have in common, at most [bytes].
inline constexpr int common_memory = 5 * 1024;

/// Columns of a block on the diagonal of a front, inverted by a warp at a time.
inline constexpr int panel_width = 8;

/// Rows and columns of a tile of the factor: what a tensor core multiplies by at once.
inline constexpr int solve_tile_width = 16, solve_tile_numbers = solve_tile_width * solve_tile_width;

/// Vertices eliminated together and those below them, as a dense matrix of three rows and columns a vertex:
/// its own rows, up to `below_at` with zeros, then those below, up to whole tiles with zeros.
struct FrontLayout {
  int first_column, column_count;  ///< own vertices, by elimination
  int first_row, row_count;        ///< vertices below: in FrontPlan::rows
  int first_map;                   ///< in FrontPlan::child_rows: one list a child, each over all its vertices
  int first_block, block_count;    ///< in FrontPlan::blocks
  int first_entry;                 ///< in FrontPlan::entries
  int first_panel_row;             ///< in FrontPlan::panel_rows, with children
  int below_at;                    ///< row, a multiple of 4
  int row_tiles, column_tiles;     ///< of its columns in the factor, row of tiles after row of tiles
  int children[2];                 ///< -1 for none
  int first_tile;                  ///< of its columns in the factor
  long update_at;  ///< of its update matrix: columns of `update_leading` numbers, behind zeros
  int update_leading;
};

/// A block of the matrix in the own columns of a front, in vertices of the front.
struct alignas(16) BlockPlace {
  int row, column;
  int transposed;
  int source;  ///< block of the BlockPattern
};

/// Fronts of one height, which do not depend on each other. In a factorization the team divides into
/// `groups`, each of which takes every groups-th front.
struct FrontLevel {
  int first_front, front_count;
  int groups;
};

FLASH_HOST_DEVICE inline int rounded_up(int number, int step) { return (number + step - 1) / step * step; }

// A front on chip: its `columns`, padded to whole blocks, each with as many own rows and then those `below`.

FLASH_HOST_DEVICE inline int padded_columns(int columns) { return rounded_up(columns, panel_width); }
/// From one column to the next: 8 or 24 modulo 32, so that eight rows of four columns lie in different banks.
FLASH_HOST_DEVICE inline int panel_leading(int columns, int below) {
  return (padded_columns(columns) + rounded_up(below, 4) + 7) / 16 * 16 + 8;
}
/// Its rows with padding for whole tiles.
FLASH_HOST_DEVICE inline int mapped_rows(int columns, int below) {
  return padded_columns(columns) + rounded_up(below, 32);
}
/// Numbers, and four of each row to find it in the front's children.
FLASH_HOST_DEVICE inline int panel_numbers(int columns, int below, bool has_children) {
  return padded_columns(columns) * panel_leading(columns, below) +
         (has_children ? 4 * mapped_rows(columns, below) : 0);
}

}  // namespace flash::sim::cuda
