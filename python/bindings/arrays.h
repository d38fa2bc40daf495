#pragma once
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <Eigen/Core>
#include <cstddef>
#include <memory>
#include <utility>
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

/// An array of numpy that has the numbers for its own.
template <class Number>
nanobind::ndarray<nanobind::numpy, Number> array_of(std::vector<Number> numbers,
                                                    const std::vector<std::size_t>& shape) {
  auto* const kept = new std::vector<Number>(std::move(numbers));
  const nanobind::capsule owner(kept,
                                [](void* own) noexcept { delete static_cast<std::vector<Number>*>(own); });
  return {kept->data(), shape.size(), shape.data(), owner};
}

/// The same of a matrix, row by row.
template <class Matrix>
auto array_of(const Matrix& matrix) {
  std::vector<typename Matrix::Scalar> numbers;
  for (Eigen::Index row = 0; row < matrix.rows(); ++row)
    for (Eigen::Index column = 0; column < matrix.cols(); ++column) numbers.push_back(matrix(row, column));
  return array_of(std::move(numbers),
                  {static_cast<std::size_t>(matrix.rows()), static_cast<std::size_t>(matrix.cols())});
}

/// What arrays on a device need: `to_host` copies one to numpy, `placed` says where it stands, `described` of
/// one that may be written to its device, type, shape, whether it is dense, and where and how long it is.
void bind_arrays(nanobind::module_& module);

}  // namespace flash::python
