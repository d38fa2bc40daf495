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

/// y = (B + sum s S) x over the vertices of a sheet in elimination order, four numbers a vertex, the last of
/// them zero: B of 3 x 3 blocks, each S scalar. A block is three columns of four numbers, so that a column is
/// one vector multiply-add.
template <typename Scalar>
class SheetProduct {
 public:
  explicit SheetProduct(const Kernels& kernels) : kernels_(&kernels) {}

  /// The pattern and the matrices of the scalar parts have to outlive the product.
  void assign(const ProductPattern& pattern, const BlockValues<double>& values,
              std::vector<ScalarPart> scalar_parts);
  void multiply(const Scalar* x, Scalar* y);

 private:
  const Kernels* kernels_;
  const ProductPattern* pattern_ = nullptr;
  std::vector<ScalarPart> scalar_parts_;
  AlignedStorage<Scalar> blocks_;  ///< 12 numbers each
};

extern template class SheetProduct<float>;
extern template class SheetProduct<double>;

}  // namespace flash::sim
