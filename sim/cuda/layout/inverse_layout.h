#pragma once

namespace flash::sim::cuda {

// Plain numbers, laid out on the host and read by kernels as they are.

/// Rows and columns of a tile of an inverse: what a tensor core multiplies by at once.
inline constexpr int inverse_tile = 16;

/// Numbers of a tile.
inline constexpr int inverse_tile_numbers = inverse_tile * inverse_tile;

/// Vertices that are eliminated together. Of them D^-1 is stored, the inverse of what is left of the matrix
/// when those before them are gone, and W = B D^-1, B the rows below. All by whole tiles with zeros.
struct InverseNode {
  int first_block, column_tiles;  ///< own slots, sixteen a block
  int first_below, below_tiles;   ///< slots below, in InverseTree::below
  int first_tile;                 ///< D^-1 row of tiles after row of tiles, then W likewise
};

/// Up to two rows of tiles of a node, for a warp.
struct InverseTask {
  int node, first, count;
};

/// Nodes of one height, which do not depend on each other.
struct InverseLevel {
  int first_node, node_count;
  int first_down, down_count;  ///< tasks of W, whose rows are those below
  int first_up, up_count;      ///< tasks of D^-1 and of the transpose of W
};

/// How the numbers of an inverse are stored: in half precision, or each as the sum of two such numbers, the
/// second times low_scale, which is as good as single precision.
enum class InversePrecision { half, single };

inline constexpr float low_scale = 2048;

inline int parts_of(InversePrecision precision) { return precision == InversePrecision::half ? 1 : 2; }

}  // namespace flash::sim::cuda
