#pragma once
#include <vector>

#include "sim/cpu/aligned_storage.h"
#include "sim/cpu/block_pattern.h"
#include "sim/cpu/row_groups.h"

namespace flash::sim {

/// Where the blocks of a BlockPattern stand in the rows of a product: both triangles of the matrix, vertices
/// in elimination order.
struct ProductPattern {
  std::vector<int> starts;       ///< where each row starts in the lists below, and where the last ends
  std::vector<int> columns;      ///< elimination position of the column's vertex
  std::vector<int> sources;      ///< block of the BlockPattern
  std::vector<char> transposed;  ///< whether the source is the transpose
};

/// The product's pattern of the diagonal and the first `pair_count` pairs.
ProductPattern product_pattern(const BlockPattern& pattern, size_t pair_count,
                               const std::vector<int>& elimination_position);

/// `scale` times a scalar matrix.
struct ScalarPart {
  const RowGroups* matrix;
  double scale;
};

/// A 3 x 3 matrix between what four vertices weigh together: w_i B w_j for each two of them.
template <typename Scalar>
struct WeightedPart {
  int positions[4];  ///< of the vertices in the elimination
  Scalar weights[4];
  Scalar block[9];  ///< B, row by row
};

/// y = (B + sum s S + sum w w^T C) x over the vertices of a sheet in elimination order, four numbers a
/// vertex, the last of them zero: B of 3 x 3 blocks, each S scalar, each C between the weighted vertices of a
/// part. A block is three columns of four numbers, so that a column is one vector multiply-add.
template <typename Scalar>
class SheetProduct {
 public:
  explicit SheetProduct(const Kernels& kernels) : kernels_(&kernels) {}

  /// The pattern and the matrices of the scalar parts have to outlive the product.
  void assign(const ProductPattern& pattern, const BlockValues<double>& values,
              std::vector<ScalarPart> scalar_parts, std::vector<WeightedPart<Scalar>> weighted_parts = {});
  void multiply(const Scalar* x, Scalar* y);

 private:
  const Kernels* kernels_;
  const ProductPattern* pattern_ = nullptr;
  std::vector<ScalarPart> scalar_parts_;
  std::vector<WeightedPart<Scalar>> weighted_parts_;
  AlignedStorage<Scalar> blocks_;  ///< 12 numbers each
};

extern template class SheetProduct<float>;
extern template class SheetProduct<double>;

}  // namespace flash::sim
