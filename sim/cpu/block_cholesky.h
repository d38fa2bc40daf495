#pragma once
#include <memory>

#include "sim/cpu/aligned_storage.h"
#include "sim/cpu/instruction_level.h"
#include "sim/cpu/symbolic_factor.h"

namespace flash::sim {

/// Multifrontal Cholesky factorization (Duff and Reid 1983; Liu 1992) with dense fronts of 3 x 3 blocks,
/// computed in Scalar. In single precision it is a preconditioner: solves read a factor rounded to half
/// precision, which stays positive definite however that rounds.
template <typename Scalar>
class BlockCholesky {
 public:
  BlockCholesky(std::shared_ptr<const SymbolicFactor> symbolic, const Kernels& kernels);

  /// L L^T = values. Returns false where a pivot is not positive; the factor is then unusable.
  bool factorize(const BlockValues<double>& values);

  /// x <- (L L^T)^-1 x over vertices in elimination order, four numbers each, the last of them zero.
  void solve_in_order(Scalar* x);

 private:
  std::shared_ptr<const SymbolicFactor> symbolic_;
  const Kernels* kernels_;
  AlignedStorage<char> factor_;      ///< panels of each front, column-major, rows padded to whole vectors
  AlignedStorage<Scalar> inverses_;  ///< inverses of the panels' diagonal blocks
  AlignedStorage<Scalar> columns_;   ///< columns of the front being eliminated
  AlignedStorage<Scalar> stack_;     ///< update matrices waiting for their parent
  AlignedStorage<Scalar> front_;     ///< numbers of the front that a solve has come to
};

extern template class BlockCholesky<double>;
extern template class BlockCholesky<float>;

}  // namespace flash::sim
