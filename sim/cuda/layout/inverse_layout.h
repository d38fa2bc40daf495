#pragma once
#include "sim/law/host_device.h"

namespace flash::sim::cuda {

// Plain numbers, laid out on the host and read by kernels as they are.

/// Rows and columns of a tile of an inverse: what a tensor core multiplies by at once.
inline constexpr int inverse_tile = 16;

/// Numbers of a tile.
inline constexpr int inverse_tile_numbers = inverse_tile * inverse_tile;

/// Vertices that are eliminated together. Of them D^-1 is stored, the inverse of what is left of the matrix
/// when those before them are gone, and W = -B D^-1, B the rows below. All by whole tiles with zeros, row of
/// tiles after row of tiles.
struct InverseNode {
  int first_block, column_tiles;  ///< own slots, sixteen a block
  int first_below, below_tiles;   ///< slots below, in InverseTree::below
  int first_D, first_W;           ///< tiles; those of all W come first, since a solve reads them twice
};

/// Nodes of one height, which do not depend on each other.
struct InverseLevel {
  int first_node, node_count;
};

/// What a warp does in a solve: rows of tiles times blocks of vectors.
struct alignas(16) SolveTask {
  int rows;          ///< one, or two that follow each other
  int columns;       ///< tiles in a row, times the node's own blocks of the right-hand side
  int below_tiles;   ///< and of the transpose of W, times what is solved below it; none on the way down
  int first_tile;    ///< of the first row; those of the second one follow
  int first_column;  ///< of the transpose: the first of below_tiles in W, `columns` apart; the next is beside
  int first_input;   ///< own block
  int first_below;   ///< in InverseTree::below
  int first_result;  ///< row of what is passed on, or slot
};

/// Nodes of one height, and their tasks.
struct SolveLevel {
  int first_slot, end_slot;
  int first_down, down_count;  ///< tasks of W, whose rows are those below
  int first_up, up_count;      ///< tasks of D^-1 and of the transpose of W
};

/// A vertex in a solve.
struct alignas(16) SolveVertex {
  int slot, place;  ///< place_in_vector
  float scale;      ///< InverseFactor::scale, 0 of one that is held
};

/// What a solve needs in one piece of memory: its tables, and behind them its vectors. Places are in bytes
/// from its begin.
struct SolveLayout {
  int level_count;
  int first_upper;  ///< slot: the first that is not of a leaf
  int tiles;
  int levels, tasks;  ///< SolveLevel, SolveTask
  int below;          ///< where rows below are in the solved vector, as lanes take them
  int gather_starts;  ///< of the slots from first_upper on, in `gathered`
  int gathered;       ///< rows that are passed to a slot
  int right;          ///< the right-hand side: a vector in blocks
  int solved;         ///< what is solved from first_upper on, likewise, and a block of zeros
  int exchange;       ///< four numbers a row: what is passed down, and then, a slot, what is solved
  int bytes;
};

// A block of sixteen slots of a vector as a tensor core takes a right factor: eight columns, the high and
// the low parts of x, of y and of z in half precision, and two of zeros. Lane l of a warp has eight bytes at
// 8 l: two rows that follow each other in column l / 4, and those eight further.

/// Bytes of a block, and from the high part of x to its low part and to y.
inline constexpr int vector_block_bytes = 256, low_part_bytes = 32, component_bytes = 64;

/// Where the high part of x of a slot is.
FLASH_HOST_DEVICE inline int place_in_vector(int slot) {
  const int row = slot % inverse_tile;
  return slot / inverse_tile * vector_block_bytes + row % 8 / 2 * 8 + row / 8 * 4 + row % 2 * 2;
}

/// How the numbers of an inverse are stored: in half precision, or each as the sum of two such numbers, the
/// second times low_scale, which is as good as single precision.
enum class InversePrecision { half, single };

inline constexpr float low_scale = 2048;

inline int parts_of(InversePrecision precision) { return precision == InversePrecision::half ? 1 : 2; }

}  // namespace flash::sim::cuda
