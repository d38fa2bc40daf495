#pragma once
#include <vector>

#include "sim/tensor.h"

namespace flash::sim::cuda {

/// What stands in a dense tensor of float64 on a device.
std::vector<double> numbers_of(const Tensor& tensor);

}  // namespace flash::sim::cuda
