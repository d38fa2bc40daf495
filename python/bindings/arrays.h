#pragma once
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <memory>

#include "sim/tensor.h"

namespace flash::python {

/// Numbers that a caller hands in: dense float64 in the memory of the processor.
using Numbers = nanobind::ndarray<const double, nanobind::c_contig, nanobind::device::cpu, nanobind::ro>;

/// The same for the simulation. It does not own them.
sim::Tensor tensor_of(const Numbers& numbers);

/// A read-only array on the memory of a tensor, which `owner` keeps alive as long as the array lives: one of
/// numpy, or on a CUDA device an object that DLPack takes.
nanobind::object view_of(const sim::Tensor& tensor, const std::shared_ptr<const void>& owner);

/// What arrays on a device need: `to_host` copies one to numpy, `placed` says where it stands.
void bind_arrays(nanobind::module_& module);

}  // namespace flash::python
