#include "sim/cuda/devices.h"

#include <algorithm>
#include <chrono>

#include "sim/cuda/device_array.h"

namespace flash::sim::cuda {

int device_count() {
  int count = 0;
  if (cudaGetDeviceCount(&count) == cudaSuccess) return count;
  cudaGetLastError();
  return 0;
}

std::string why_not(int device) {
  constexpr int least_memory = 99 * 1024;
  int bytes = 0;
  const cudaError_t status = cudaDeviceGetAttribute(&bytes, cudaDevAttrMaxSharedMemoryPerBlockOptin, device);
  if (status != cudaSuccess) return cudaGetErrorString(status);
  return bytes < least_memory ? "the device has less than 99 KB of memory on chip for a block" : "";
}

std::string why_no_device() {
  int count = 0;
  const cudaError_t status = cudaGetDeviceCount(&count);
  if (status != cudaSuccess) return cudaGetErrorString(status);
  return count == 0 ? "no device" : why_not(0);
}

void use_device(int device) { check(cudaSetDevice(device)); }

int device_in_use() {
  int device = 0;
  check(cudaGetDevice(&device));
  return device;
}

namespace {

/// Multiply-adds in single precision that a processor starts per clock (CUDA programming guide, arithmetic
/// instructions).
int single_lanes(int major, int minor) { return major == 7 || (major == 8 && minor == 0) ? 64 : 128; }

}  // namespace

Rates rates_of(int device) {
  use_device(device);
  const auto attribute = [device](cudaDeviceAttr which) {
    int value = 0;
    check(cudaDeviceGetAttribute(&value, which, device));
    return value;
  };
  Rates rates;
  cudaDeviceProp properties{};
  check(cudaGetDeviceProperties(&properties, device));
  rates.name = properties.name;
  rates.single_flops = 2e3 * attribute(cudaDevAttrClockRate) * properties.multiProcessorCount *
                       single_lanes(properties.major, properties.minor);

  std::size_t free = 0, all = 0;
  check(cudaMemGetInfo(&free, &all));
  constexpr std::size_t most = std::size_t{1} << 28;
  const DeviceArray<char> numbers(2 * std::min(most, free / 4));
  const std::size_t bytes = numbers.size() / 2;
  constexpr int repetitions = 20;
  double best = 0;
  for (int round = 0; round < 3; ++round) {
    const auto start = std::chrono::steady_clock::now();
    for (int k = 0; k < repetitions; ++k)
      check(cudaMemcpyAsync(numbers.data(), numbers.data() + bytes, bytes, cudaMemcpyDeviceToDevice,
                            cudaStreamPerThread));
    check(cudaStreamSynchronize(cudaStreamPerThread));
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    best = std::max(best, 2.0 * repetitions * static_cast<double>(bytes) / seconds);
  }
  rates.copied_bytes = best;
  return rates;
}

}  // namespace flash::sim::cuda
