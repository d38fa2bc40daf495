#include "sim/device_copies.h"

#include <cstdint>
#include <vector>

#include "data/files/error.h"
#include "sim/device.h"
#ifdef FLASH_HAVE_CUDA
#include "sim/ask_device.h"
#include "sim/cuda/device_array.h"
#include "sim/cuda/devices.h"
#endif

namespace flash::sim {

#ifdef FLASH_HAVE_CUDA

struct DeviceCopies::Storage {
  struct Copy {
    std::span<const double> from;
    cuda::DeviceArray<double> to;
  };
  int device;
  std::vector<Copy> copies;
};

DeviceCopies::DeviceCopies(int cuda_device) : storage_(new Storage{cuda_device, {}}) {}
DeviceCopies::~DeviceCopies() = default;
int DeviceCopies::cuda_device() const { return storage_->device; }

const double* DeviceCopies::of(std::span<const double> numbers) {
  std::vector<Storage::Copy>& copies = storage_->copies;
  for (const Storage::Copy& copy : copies)
    if (copy.from.data() == numbers.data()) return copy.to.data();
  return ask_device([&] {
    cuda::use_device(storage_->device);
    Storage::Copy copy{numbers, cuda::DeviceArray<double>(numbers.size())};
    copy.to.write(0, numbers.data(), numbers.size());
    copies.push_back(std::move(copy));
    return static_cast<const double*>(copies.back().to.data());
  });
}

void DeviceCopies::renew() {
  if (storage_->copies.empty()) return;
  ask_device([&] {
    cuda::use_device(storage_->device);
    for (Storage::Copy& copy : storage_->copies) copy.to.write(0, copy.from.data(), copy.from.size());
  });
}

// A thread's own stream waits for the default stream of its device.
void read_device(int cuda_device, const void* from, std::size_t bytes, void* to) {
  ask_device([&] {
    cuda::use_device(cuda_device);
    if (bytes > 0) cuda::copy_to_end(to, from, bytes, cudaMemcpyDeviceToHost);
  });
}

int cuda_device_of_thread() {
  int device = -1;
  return cudaGetDevice(&device) == cudaSuccess ? device : -1;
}

void return_to_cuda_device(int device) {
  if (device >= 0 && cuda_device_of_thread() != device) cudaSetDevice(device);
}

#else

struct DeviceCopies::Storage {};

DeviceCopies::DeviceCopies(int) { throw data::InputError("--device cuda: " + why_no_cuda()); }
DeviceCopies::~DeviceCopies() = default;
int DeviceCopies::cuda_device() const { return 0; }
const double* DeviceCopies::of(std::span<const double>) { return nullptr; }
void DeviceCopies::renew() {}

void read_device(int, const void*, std::size_t, void*) {
  throw data::InputError("--device cuda: " + why_no_cuda());
}

int cuda_device_of_thread() { return -1; }
void return_to_cuda_device(int) {}

#endif

Tensor DeviceCopies::of(const Tensor& tensor) {
  std::size_t count = 1;
  for (const std::int64_t length : tensor.shape) count *= static_cast<std::size_t>(length);
  Tensor there = tensor;
  there.data = of(std::span(static_cast<const double*>(tensor.data), count));
  there.device = Device::cuda;
  there.device_number = cuda_device();
  return there;
}

}  // namespace flash::sim
