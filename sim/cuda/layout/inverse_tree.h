#pragma once
#include <vector>

#include "data/mesh.h"
#include "sim/cpu/block_pattern.h"

namespace flash::sim::cuda {

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

/// How the inverse of a symmetric scalar matrix is applied to vectors by few, wide steps: nested dissection,
/// with separators of two heights of the tree in one node. Vertices have slots, in whole blocks a node, the
/// leaves first; one more block is always zero.
struct InverseTree {
  int size = 0;   ///< vertices
  int slots = 0;  ///< the block of zeros is behind them
  int tiles = 0;
  std::vector<int> slot_of;                  ///< of each vertex
  std::vector<int> vertex_at;                ///< of each slot, -1 for none
  std::vector<InverseNode> nodes;            ///< level after level, the root last
  std::vector<int> parents;                  ///< of each node, -1 for none
  std::vector<int> below;                    ///< slots; that of the zeros where there is none
  std::vector<int> gather_starts, gathered;  ///< of each slot: places in `below` that are it
  std::vector<InverseLevel> levels;
  std::vector<InverseTask> tasks;

  int nothing() const { return slots; }
  long products = 0;  ///< of tiles with blocks of a vector, in one application
};

/// The tree of a matrix with these entries. `places` of the vertices guide the order (dissection.h).
InverseTree plan_inverse(const BlockPattern& pattern, const data::Points& places, int leaf_size = 64);

}  // namespace flash::sim::cuda
