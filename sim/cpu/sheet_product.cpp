#include "sim/cpu/sheet_product.h"

#include <utility>

#include "sim/cpu/kernels.h"

namespace flash::sim {

ProductPattern product_pattern(const BlockPattern& pattern, size_t pair_count,
                               const std::vector<int>& position) {
  struct Entry {
    int column, source;
    bool transposed;
  };
  std::vector<std::vector<Entry>> rows(pattern.size);
  for (int vertex = 0; vertex < pattern.size; ++vertex)
    rows[position[vertex]].push_back({position[vertex], vertex, false});
  for (size_t k = 0; k < pair_count; ++k) {
    const int row = position[pattern.pairs[k].first], column = position[pattern.pairs[k].second];
    const int source = pattern.size + static_cast<int>(k);
    rows[row].push_back({column, source, false});
    rows[column].push_back({row, source, true});
  }
  ProductPattern product;
  product.starts.push_back(0);
  for (const auto& row : rows) {
    for (const Entry& entry : row) {
      product.columns.push_back(entry.column);
      product.sources.push_back(entry.source);
      product.transposed.push_back(entry.transposed);
    }
    product.starts.push_back(static_cast<int>(product.columns.size()));
  }
  return product;
}

template <typename Scalar>
void SheetProduct<Scalar>::assign(const ProductPattern& pattern, const BlockValues<double>& values,
                                  std::vector<ScalarPart> scalar_parts) {
  pattern_ = &pattern;
  scalar_parts_ = std::move(scalar_parts);
  blocks_.resize(12 * pattern.sources.size());
  linear<Scalar>(*kernels_).copy_blocks(static_cast<int>(pattern.sources.size()), pattern.sources.data(),
                                        pattern.transposed.data(), values.data(), blocks_.data());
}

template <typename Scalar>
void SheetProduct<Scalar>::multiply(const Scalar* x, Scalar* y) {
  const BlockRows rows = {static_cast<int>(pattern_->starts.size()) - 1, pattern_->starts.data(),
                          pattern_->columns.data()};
  linear<Scalar>(*kernels_).multiply_blocks(rows, blocks_.data(), x, y);
  for (const ScalarPart& part : scalar_parts_)
    add_product(*kernels_, *part.matrix, static_cast<Scalar>(part.scale), x, y);
}

template class SheetProduct<float>;
template class SheetProduct<double>;

}  // namespace flash::sim
