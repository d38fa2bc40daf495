#pragma once
#include <utility>
#include <vector>

namespace flash::sim {

/// Sparsity of a symmetric matrix of 3 x 3 blocks: every diagonal block and the listed pairs (row, column),
/// row != column, each unordered pair once.
struct BlockPattern {
  int size = 0;                            ///< vertices
  std::vector<std::pair<int, int>> pairs;  ///< off-diagonal blocks
};

/// Values over a BlockPattern: `size` diagonal blocks, then one block a pair, 9 numbers each, column-major.
template <typename Scalar>
using BlockValues = std::vector<Scalar>;

}  // namespace flash::sim
