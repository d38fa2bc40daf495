#pragma once
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "sim/tensor.h"

namespace flash::python {

/// Numbers that a caller hands in: dense float64 in the memory of the processor.
using Numbers = nanobind::ndarray<const double, nanobind::c_contig, nanobind::device::cpu, nanobind::ro>;

/// The same for the simulation. It does not own them.
sim::Tensor tensor_of(const Numbers& numbers);

/// A read-only array on the memory of a tensor, which `owner` keeps alive as long as the array lives: one of
/// numpy, or on a CUDA device an object that DLPack takes.
nanobind::object view_of(const sim::Tensor& tensor, const std::shared_ptr<const void>& owner);

/// A matrix as an array of its own.
template <class Matrix>
auto array_of(const Matrix& matrix) {
  using Number = typename Matrix::Scalar;
  auto* numbers = new std::vector<Number>;
  const nanobind::capsule owner(numbers,
                                [](void* kept) noexcept { delete static_cast<std::vector<Number>*>(kept); });
  for (Eigen::Index row = 0; row < matrix.rows(); ++row)
    for (Eigen::Index column = 0; column < matrix.cols(); ++column) numbers->push_back(matrix(row, column));
  const auto rows = static_cast<std::size_t>(matrix.rows()),
             columns = static_cast<std::size_t>(matrix.cols());
  return nanobind::ndarray<nanobind::numpy, Number>(numbers->data(), {rows, columns}, owner);
}

/// What arrays on a device need: `to_host` copies one to numpy, `placed` says where it stands.
void bind_arrays(nanobind::module_& module);

}  // namespace flash::python
