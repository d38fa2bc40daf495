#include "tests/sim/cuda/device_numbers.h"

#include <cuda_runtime.h>

namespace flash::sim::cuda {

std::vector<double> numbers_of(const Tensor& tensor) {
  std::size_t count = 1;
  for (const std::int64_t length : tensor.shape) count *= static_cast<std::size_t>(length);
  std::vector<double> numbers(count);
  cudaSetDevice(tensor.device_number);
  cudaMemcpy(numbers.data(), tensor.data, count * sizeof(double), cudaMemcpyDeviceToHost);
  return numbers;
}

}  // namespace flash::sim::cuda
