#include "sim/cpu/block_cholesky.h"

#include "sim/cpu/kernels.h"

namespace flash::sim {

template <typename Scalar>
BlockCholesky<Scalar>::BlockCholesky(std::shared_ptr<const SymbolicFactor> symbolic, const Kernels& kernels)
    : symbolic_(std::move(symbolic)), kernels_(&kernels) {
  factor_.resize(linear<Scalar>(kernels).stored_bytes * symbolic_->factor_size);
  inverses_.resize(inverse_size * symbolic_->position.size());
  // Rows below a front's own are read by whole vectors from where they start: past the end of its last
  // column.
  columns_.resize(symbolic_->largest_columns + front_padding);
  stack_.resize(symbolic_->stack_size);
  front_.resize(symbolic_->largest_front + front_padding);
}

template <typename Scalar>
bool BlockCholesky<Scalar>::factorize(const BlockValues<double>& values) {
  return linear<Scalar>(*kernels_).factorize(symbolic_->tree(), values.data(), columns_.data(), stack_.data(),
                                             factor_.data(), inverses_.data());
}

template <typename Scalar>
void BlockCholesky<Scalar>::solve_in_order(Scalar* x) {
  linear<Scalar>(*kernels_).solve(symbolic_->tree(), factor_.data(), inverses_.data(), front_.data(), x);
}

template class BlockCholesky<double>;
template class BlockCholesky<float>;

}  // namespace flash::sim
