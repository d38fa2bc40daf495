#pragma once
#include <memory>
#include <utility>
#include <vector>

#include "sim/cpu/aligned_storage.h"
#include "sim/cpu/instruction_level.h"

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

/// Ordering, elimination tree and supernodes of a pattern: computed once a mesh, shared by all environments
/// and threads. Approximate minimum degree on the vertex graph (three unknowns a vertex stay together).
struct SymbolicFactor;
std::shared_ptr<const SymbolicFactor> analyze(const BlockPattern& pattern);

/// Where a vertex comes in the elimination.
const std::vector<int>& elimination_position(const SymbolicFactor& symbolic);

/// Entries of L, in scalars.
long factor_entries(const SymbolicFactor& symbolic);

/// Multifrontal Cholesky factorization (Duff and Reid 1983; Liu 1992) with dense fronts of 3 x 3 blocks,
/// computed in Scalar. In single precision a preconditioner: what solves read of it is rounded to
/// half precision, and however that rounds, it stays positive definite.
template <typename Scalar>
class BlockCholesky {
 public:
  BlockCholesky(std::shared_ptr<const SymbolicFactor> symbolic, const Kernels& kernels);

  /// L L^T = values. Returns false where a pivot is not positive; the factor is then unusable.
  bool factorize(const BlockValues<double>& values);

  /// x <- (L L^T)^-1 x, for x of 3 * size entries, vertex by vertex.
  void solve_in_place(double* x);

  /// The same for vertices in elimination order, four numbers each, the last of them zero: no number is
  /// moved.
  void solve_in_order(Scalar* x);

 private:
  std::shared_ptr<const SymbolicFactor> symbolic_;
  const Kernels* kernels_;
  AlignedStorage<char> factor_;      ///< per front: its panels, column-major, rows padded to whole vectors
  AlignedStorage<Scalar> inverses_;  ///< of the panels' diagonal blocks
  AlignedStorage<Scalar> columns_;   ///< of the front that is eliminated
  AlignedStorage<Scalar> stack_;     ///< update matrices waiting for their parent
  AlignedStorage<Scalar> front_;     ///< numbers of the front that a solve has come to
};

extern template class BlockCholesky<double>;
extern template class BlockCholesky<float>;

}  // namespace flash::sim
