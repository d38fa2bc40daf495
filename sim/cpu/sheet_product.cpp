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

namespace {

template <typename Scalar>
void add_weighted(const WeightedPart<Scalar>& part, const Scalar* x, Scalar* y) {
  Scalar between[3] = {};
  for (int k = 0; k < 4; ++k)
    for (int c = 0; c < 3; ++c) between[c] += part.weights[k] * x[4L * part.positions[k] + c];
  const Scalar* b = part.block;
  Scalar image[3];
  for (int c = 0; c < 3; ++c)
    image[c] = b[3 * c] * between[0] + b[3 * c + 1] * between[1] + b[3 * c + 2] * between[2];
  for (int k = 0; k < 4; ++k)
    for (int c = 0; c < 3; ++c) y[4L * part.positions[k] + c] += part.weights[k] * image[c];
}

}  // namespace

template <typename Scalar>
void SheetProduct<Scalar>::assign(const ProductPattern& pattern, const BlockValues<double>& values,
                                  std::vector<ScalarPart> scalar_parts,
                                  std::vector<WeightedPart<Scalar>> weighted_parts) {
  pattern_ = &pattern;
  scalar_parts_ = std::move(scalar_parts);
  weighted_parts_ = std::move(weighted_parts);
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
  for (const WeightedPart<Scalar>& part : weighted_parts_) add_weighted(part, x, y);
}

template class SheetProduct<float>;
template class SheetProduct<double>;

}  // namespace flash::sim
