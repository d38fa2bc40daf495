#pragma once
#include <cuda_runtime.h>

#include <cstddef>
#include <memory>

#include "sim/cuda/launch.h"

namespace flash::sim::cuda {

/// Numbers of the host that a device reads and writes by itself. Copies from and to other memory go through
/// few buffers of the driver, for which threads wait.
template <typename Number>
class PinnedArray {
 public:
  explicit PinnedArray(std::size_t size) {
    if (size == 0) return;
    Number* numbers = nullptr;
    check(cudaMallocHost(&numbers, size * sizeof(Number)));
    numbers_.reset(numbers);
  }
  Number* data() { return numbers_.get(); }
  const Number* data() const { return numbers_.get(); }

 private:
  struct Free {
    void operator()(Number* numbers) const { cudaFreeHost(numbers); }
  };
  std::unique_ptr<Number[], Free> numbers_;
};

}  // namespace flash::sim::cuda
