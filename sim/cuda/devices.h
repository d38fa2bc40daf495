#pragma once
#include <string>

namespace flash::sim::cuda {

/// CUDA devices of this machine; 0 where they cannot be asked.
int device_count();

/// Why a device, by number, cannot be used, in a line; empty where it can.
std::string why_not(int device);

/// Why the first one cannot be used.
std::string why_no_device();

/// Makes a device the one that this thread works with. Throws std::runtime_error with its message.
void use_device(int device);

/// That which this thread works with.
int device_in_use();

/// As sim::DeviceRates.
struct Rates {
  std::string name;
  double copied_bytes = 0, single_flops = 0;
};

/// Copies half of the free memory, at most 512 MB, for some milliseconds. Leaves the device in use.
Rates rates_of(int device);

}  // namespace flash::sim::cuda
