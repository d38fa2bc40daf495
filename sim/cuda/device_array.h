#pragma once
#include <cuda_runtime.h>

#include <utility>
#include <vector>

#include "sim/cuda/launch.h"

namespace flash::sim::cuda {

// What a host thread writes and reads goes through a stream of its own, to its end: replays of other threads
// go on beside it.

inline void copy_to_end(void* to, const void* from, size_t bytes, cudaMemcpyKind kind) {
  check(cudaMemcpyAsync(to, from, bytes, kind, cudaStreamPerThread));
  check(cudaStreamSynchronize(cudaStreamPerThread));
}
inline void fill_with_zeros(void* memory, size_t bytes) {
  check(cudaMemsetAsync(memory, 0, bytes, cudaStreamPerThread));
  check(cudaStreamSynchronize(cudaStreamPerThread));
}

/// Numbers in the memory of the device. What runs on a stream has to have ended before they are read or
/// written.
template <typename Number>
class DeviceArray {
 public:
  DeviceArray() = default;
  /// All zero.
  explicit DeviceArray(size_t size) : size_(size) {
    if (size == 0) return;
    check(cudaMalloc(&data_, size * sizeof(Number)));
    fill_with_zeros(data_, size * sizeof(Number));
  }
  explicit DeviceArray(const std::vector<Number>& numbers) : DeviceArray(numbers.size()) {
    write(0, numbers.data(), numbers.size());
  }
  ~DeviceArray() { cudaFree(data_); }
  DeviceArray(DeviceArray&& other) noexcept { swap(other); }
  DeviceArray& operator=(DeviceArray&& other) noexcept {
    swap(other);
    return *this;
  }

  /// Room for so many numbers at least. What was in it is lost where it has to grow.
  void hold(size_t size) {
    if (size <= size_) return;
    *this = DeviceArray();  // so that both need not fit
    *this = DeviceArray(size);
  }

  Number* data() const { return data_; }
  size_t size() const { return size_; }

  void write(size_t first, const Number* numbers, size_t count) {
    if (count > 0) copy_to_end(data_ + first, numbers, count * sizeof(Number), cudaMemcpyHostToDevice);
  }
  void read(size_t first, size_t count, Number* to) const {
    if (count > 0) copy_to_end(to, data_ + first, count * sizeof(Number), cudaMemcpyDeviceToHost);
  }
  std::vector<Number> read(size_t first, size_t count) const {
    std::vector<Number> numbers(count);
    read(first, count, numbers.data());
    return numbers;
  }

 private:
  void swap(DeviceArray& other) noexcept {
    std::swap(data_, other.data_);
    std::swap(size_, other.size_);
  }

  Number* data_ = nullptr;
  size_t size_ = 0;
};

}  // namespace flash::sim::cuda
