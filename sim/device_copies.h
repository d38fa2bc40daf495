#pragma once
#include <cstddef>
#include <memory>
#include <span>

#include "sim/tensor.h"

namespace flash::sim {

/// Copies on a CUDA device of numbers of the host, which stay where they are. Throws a DeviceError where the
/// device is lost, OutOfDeviceMemory where its memory does not suffice.
class DeviceCopies {
 public:
  explicit DeviceCopies(int cuda_device);
  ~DeviceCopies();

  int cuda_device() const;

  /// The copy of numbers, made when it is first asked for. It stays where it is.
  const double* of(std::span<const double> numbers);

  /// Of all numbers of a dense tensor of the host, as a tensor.
  Tensor of(const Tensor& tensor);

  /// Brings all of them to what the numbers are now. What others have queued on the device's default stream
  /// comes before.
  void renew();

 private:
  struct Storage;
  std::unique_ptr<Storage> storage_;
};

/// Brings bytes from the memory of a CUDA device, once what others have queued on its default stream has
/// ended.
void read_device(int cuda_device, const void* from, std::size_t bytes, void* to);

/// The CUDA device that this thread works with, -1 where there is none.
int cuda_device_of_thread();

/// Makes it that one again; does nothing for -1.
void return_to_cuda_device(int device);

/// The CUDA device that this thread works with is the same afterwards: other libraries look at it too.
class KeptCudaDevice {
 public:
  KeptCudaDevice() : device_(cuda_device_of_thread()) {}
  ~KeptCudaDevice() { return_to_cuda_device(device_); }
  KeptCudaDevice(const KeptCudaDevice&) = delete;
  KeptCudaDevice& operator=(const KeptCudaDevice&) = delete;

 private:
  int device_;
};

}  // namespace flash::sim
