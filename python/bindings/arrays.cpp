#include "python/bindings/arrays.h"

#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include "sim/device_copies.h"

namespace flash::python {

namespace nb = nanobind;

namespace {

using AnyArray = nb::ndarray<nb::ro>;
using Bytes = std::vector<std::byte>;

template <class Kept>
nb::capsule keeper_of(Kept* kept) {
  return {kept, [](void* own) noexcept { delete static_cast<Kept*>(own); }};
}

void read_bytes(const AnyArray& array, const std::byte* from, Bytes& to) {
  const int kind = array.device_type();
  const nb::gil_scoped_release release;
  if (kind == nb::device::cuda::value || kind == nb::device::cuda_managed::value) {
    const sim::KeptCudaDevice kept;
    sim::read_device(array.device_id(), from, to.size(), to.data());
  } else if (kind == nb::device::cpu::value || kind == nb::device::cuda_host::value) {
    std::memcpy(to.data(), from, to.size());
  } else {
    throw nb::type_error("found an array on a device that is none of CUDA, expected one of that or the CPU");
  }
}

/// Copies all that lies between the first and the last number of an array, with its strides.
nb::ndarray<nb::numpy> to_host(const AnyArray& array) {
  std::vector<std::size_t> shape;
  std::vector<std::int64_t> strides;
  std::int64_t first = 0, last = 0;
  for (std::size_t k = 0; k < array.ndim(); ++k) {
    shape.push_back(array.shape(k));
    strides.push_back(array.stride(k));
    const std::int64_t way = (static_cast<std::int64_t>(shape[k]) - 1) * strides[k];
    (way < 0 ? first : last) += way;
  }
  const auto width = static_cast<std::int64_t>(array.itemsize());
  const auto size = array.size() == 0 ? 0 : static_cast<std::size_t>((last - first + 1) * width);
  auto* bytes = new Bytes(size);
  const nb::capsule keeper = keeper_of(bytes);
  const std::int64_t start = array.size() == 0 ? 0 : -first * width;
  if (size > 0) read_bytes(array, static_cast<const std::byte*>(array.data()) - start, *bytes);
  return {bytes->data() + start, shape.size(), shape.data(), keeper, strides.data(), array.dtype()};
}

}  // namespace

sim::Tensor tensor_of(const Numbers& numbers) {
  sim::Tensor tensor{.data = numbers.data()};
  for (std::size_t k = 0; k < numbers.ndim(); ++k)
    tensor.shape.push_back(static_cast<std::int64_t>(numbers.shape(k)));
  return tensor;
}

nb::object view_of(const sim::Tensor& tensor, const std::shared_ptr<const void>& owner) {
  const nb::capsule keeper = keeper_of(new std::shared_ptr<const void>(owner));
  const std::vector<std::size_t> shape(tensor.shape.begin(), tensor.shape.end());
  const std::int64_t* strides = tensor.strides.empty() ? nullptr : tensor.strides.data();
  const auto* data = static_cast<const double*>(tensor.data);
  if (tensor.device == sim::Device::cpu)
    return nb::cast(nb::ndarray<nb::numpy, const double>(data, shape.size(), shape.data(), keeper, strides));
  return nb::cast(nb::ndarray<nb::array_api, const double>(data, shape.size(), shape.data(), keeper, strides,
                                                           nb::dtype<double>(), nb::device::cuda::value,
                                                           tensor.device_number));
}

void bind_arrays(nb::module_& module) {
  module.def("to_host", &to_host);
  module.def("described", [](const nb::ndarray<>& array) {
    std::int64_t dense = 1;
    bool contiguous = true;
    std::vector<std::size_t> shape(array.ndim());
    for (std::size_t k = array.ndim(); k-- > 0;) {
      shape[k] = array.shape(k);
      contiguous = contiguous && (array.stride(k) == dense || array.shape(k) == 1);
      dense *= static_cast<std::int64_t>(shape[k]);
    }
    const nb::dlpack::dtype type = array.dtype();
    const char* kind = type.code == static_cast<std::uint8_t>(nb::dlpack::dtype_code::Float)  ? "float"
                       : type.code == static_cast<std::uint8_t>(nb::dlpack::dtype_code::Int)  ? "int"
                       : type.code == static_cast<std::uint8_t>(nb::dlpack::dtype_code::UInt) ? "uint"
                                                                                              : "other";
    return nb::make_tuple(array.device_id(), kind + std::to_string(type.bits), nb::tuple(nb::cast(shape)),
                          contiguous, reinterpret_cast<std::uintptr_t>(array.data()), array.nbytes());
  });
  module.def("placed", [](const AnyArray& array) {
    nb::list shape, strides;
    for (std::size_t k = 0; k < array.ndim(); ++k) {
      shape.append(array.shape(k));
      strides.append(array.stride(k) * static_cast<std::int64_t>(array.itemsize()));
    }
    return nb::make_tuple(reinterpret_cast<std::uintptr_t>(array.data()), nb::tuple(shape),
                          nb::tuple(strides));
  });
}

}  // namespace flash::python
