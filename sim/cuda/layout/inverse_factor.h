#pragma once
#include <Eigen/SparseCore>
#include <cstdint>
#include <vector>

#include "sim/cuda/layout/inverse_tree.h"

namespace flash::sim::cuda {

/// The numbers of an InverseTree for S A S, S = diag(A)^(-1/2), whose entries have the size of 1.
struct InverseFactor {
  std::vector<std::uint16_t> tiles;  ///< as place_in_inverse_tile says; a second part behind each first one
  std::vector<float> scale;          ///< S by slot, 0 for vertices that are held
};

/// Where the number at `row` and `column` of a tile is: by lanes of a warp, as a tensor core takes a left
/// factor, eight numbers each.
inline int place_in_inverse_tile(int row, int column) {
  const int lane = row % 8 * 4 + column % 8 / 2;
  return lane * 8 + (column / 8 * 2 + row / 8) * 2 + column % 2;
}

/// Factorizes A without the rows and columns of held vertices. Throws std::domain_error where it is not
/// positive definite.
InverseFactor factorize_inverse(const InverseTree& tree, const Eigen::SparseMatrix<double>& A,
                                const std::vector<char>& held, InversePrecision precision);

/// A^-1 b by the tiles, in single precision, as the device goes about it; zero where vertices are held.
data::Points apply_inverse(const InverseTree& tree, const InverseFactor& factor, InversePrecision precision,
                           const data::Points& b);

}  // namespace flash::sim::cuda
