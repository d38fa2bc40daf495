#pragma once
#include <Eigen/SparseCore>
#include <vector>

#include "data/mesh/mesh.h"
#include "sim/cpu/block_pattern.h"
#include "sim/cuda/layout/inverse_layout.h"

namespace flash::sim::cuda {

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

  int nothing() const { return slots; }
  long products = 0;  ///< of tiles with blocks of a vector, in one application
};

/// Which entries off its diagonal a symmetric matrix has.
BlockPattern pattern_of(const Eigen::SparseMatrix<double>& matrix);

/// The tree of a matrix with these entries. `places` of the vertices guide the order (dissection.h).
InverseTree plan_inverse(const BlockPattern& pattern, const data::Points& places, int leaf_size = 64);

}  // namespace flash::sim::cuda
