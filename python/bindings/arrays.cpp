#include "python/bindings/arrays.h"

#include <cstddef>
#include <vector>

namespace flash::python {

namespace nb = nanobind;

sim::Tensor tensor_of(const Numbers& numbers) {
  sim::Tensor tensor{.data = numbers.data()};
  for (std::size_t k = 0; k < numbers.ndim(); ++k)
    tensor.shape.push_back(static_cast<std::int64_t>(numbers.shape(k)));
  return tensor;
}

nb::ndarray<nb::numpy, const double> view_of(const sim::Tensor& tensor,
                                             const std::shared_ptr<const void>& owner) {
  using Owner = std::shared_ptr<const void>;
  const nb::capsule keeper(new Owner(owner), [](void* kept) noexcept { delete static_cast<Owner*>(kept); });
  const std::vector<std::size_t> shape(tensor.shape.begin(), tensor.shape.end());
  return {static_cast<const double*>(tensor.data), shape.size(), shape.data(), keeper,
          tensor.strides.empty() ? nullptr : tensor.strides.data()};
}

}  // namespace flash::python
