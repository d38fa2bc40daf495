#include "sim/sheet_product.h"

#include "sim/lanes.h"

namespace flash::sim {

ProductPattern product_pattern(const BlockPattern& pattern, size_t pair_count,
                               const std::vector<int>& position) {
  struct Entry {
    int column, source;
    bool turned;
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
      product.turned.push_back(entry.turned);
    }
    product.starts.push_back(static_cast<int>(product.columns.size()));
  }
  return product;
}

template <typename Scalar>
void SheetProduct<Scalar>::assign(const ProductPattern& pattern, const BlockValues<double>& values,
                                  const RowGroups& scalar_part, double scale) {
  pattern_ = &pattern;
  scalar_part_ = &scalar_part;
  scale_ = static_cast<Scalar>(scale);
  blocks_.resize(12 * pattern.sources.size());
  padded_.resize(4 * (pattern.starts.size() - 1));
  for (size_t k = 0; k < pattern.sources.size(); ++k) {
    const double* from = values.data() + 9L * pattern.sources[k];
    Scalar* to = blocks_.data() + 12 * k;
    if (pattern.turned[k]) {
      for (int c = 0; c < 3; ++c)
        for (int r = 0; r < 3; ++r) to[4 * c + r] = static_cast<Scalar>(from[3 * r + c]);
    } else {
      for (int c = 0; c < 3; ++c)
        for (int r = 0; r < 3; ++r) to[4 * c + r] = static_cast<Scalar>(from[3 * c + r]);
    }
  }
}

template <typename Scalar>
void SheetProduct<Scalar>::multiply(const Scalar* x, Scalar* y) {
  using Four = typename FourOf<Scalar>::type;
  const size_t size = pattern_->starts.size() - 1;
  for (size_t i = 0; i < size; ++i)
    for (int c = 0; c < 3; ++c) padded_[4 * i + c] = x[3 * i + c];
  for (size_t i = 0; i < size; ++i) {
    Four sum{}, even{}, odd{};
    for (int k = pattern_->starts[i]; k < pattern_->starts[i + 1]; ++k) {
      const Scalar* block = blocks_.data() + 12L * k;
      const Scalar* from = padded_.data() + 4L * pattern_->columns[k];
      sum += load_four(block) * from[0];
      even += load_four(block + 4) * from[1];
      odd += load_four(block + 8) * from[2];
    }
    sum += even + odd;
    for (int c = 0; c < 3; ++c) y[3 * i + c] = sum[c];
  }
  add_product(*scalar_part_, scale_, padded_.data(), y);
}

template class SheetProduct<float>;
template class SheetProduct<double>;

}  // namespace flash::sim
