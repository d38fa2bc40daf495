#pragma once
#include <algorithm>
#include <cstddef>
#include <vector>

namespace flash::data {

/// The middle one in order; of an even number the larger of the middle two, of none 0.
inline double median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace flash::data
