#pragma once

namespace flash::sim::cuda {

// Plain numbers, laid out on the host and read by kernels as they are.

/// Threads of a team: the block that works on one environment. A power of two.
inline constexpr int team_threads = 256;
inline constexpr int team_warps = team_threads / 32;
static_assert((team_threads & (team_threads - 1)) == 0);

/// Teams that a processor of the device has registers for, at least: dense fronts and triangles need many,
/// the rest of a linear problem needs many threads.
inline constexpr int dense_teams = 2, sparse_teams = 4;

/// Columns that are eliminated between two barriers.
inline constexpr int panel_width = 12;

/// Rows that a warp takes in one sweep of a forward task, and columns of a backward task.
inline constexpr int forward_rows = 16, backward_columns = 8;

/// Vertices eliminated together and those below them, as a dense matrix of three rows and columns a vertex:
/// its own rows, up to `below_at` with zeros, then those below, up to `leading` with zeros.
struct FrontLayout {
  int first_column, column_count;  ///< own vertices, by elimination
  int first_row, row_count;        ///< vertices below: in FrontPlan::rows
  int first_map;                   ///< in FrontPlan::child_rows: one list a child, each over all its vertices
  int first_block, block_count;    ///< in FrontPlan::blocks
  int first_entry;                 ///< in FrontPlan::entries
  int below_at, leading;           ///< rows; multiples of 4 and of 16
  int vector_at;                   ///< of what it passes up in a forward solve, three numbers a vertex below
  int children[2];                 ///< -1 for none
  long panel_at;                   ///< of its columns in the factor
  long update_at;                  ///< of its update matrix: columns of `update_leading` numbers
  int update_leading;
};

/// A block of the matrix in the own columns of a front, in vertices of the front.
struct alignas(16) BlockPlace {
  int row, column;
  int transposed;
  int source;  ///< block of the BlockPattern
};

/// Rows `first_row` to `end_row` of a front's columns times its own numbers.
struct ForwardTask {
  int front, first_row, end_row;
};

/// Columns `first_column` on of a front, `backward_columns` at most, times all its numbers.
struct BackwardTask {
  int front, first_column;
};

/// Fronts of one height, which do not depend on each other. In a factorization the team divides into
/// `groups`, each of which takes every groups-th front.
struct FrontLevel {
  int first_front, front_count;
  int first_forward, forward_count;
  int first_backward, backward_count;
  int groups;
};

/// Between the columns of a panel on chip, so that consecutive ones start in different banks.
inline constexpr int panel_padding = 4;

}  // namespace flash::sim::cuda
