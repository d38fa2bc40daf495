#pragma once
#include <vector>

#include "sim/cpu/block_cholesky.h"

namespace flash::sim {

/// x <- (L L^T)^-1 x, for x of three numbers a vertex, as the pattern numbers them.
template <typename Scalar>
void solve_in_place(BlockCholesky<Scalar>& factor, const std::vector<int>& position, double* x) {
  AlignedStorage<Scalar> ordered(4 * position.size());
  for (std::size_t vertex = 0; vertex < position.size(); ++vertex)
    for (int c = 0; c < 3; ++c) ordered[4 * position[vertex] + c] = static_cast<Scalar>(x[3 * vertex + c]);
  factor.solve_in_order(ordered.data());
  for (std::size_t vertex = 0; vertex < position.size(); ++vertex)
    for (int c = 0; c < 3; ++c) x[3 * vertex + c] = ordered[4 * position[vertex] + c];
}

}  // namespace flash::sim
