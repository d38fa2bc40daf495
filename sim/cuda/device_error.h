#pragma once
#include <stdexcept>

namespace flash::sim::cuda {

/// What a device says where it cannot go on, in a line.
struct DeviceError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The device's memory does not suffice.
struct OutOfMemory : DeviceError {
  using DeviceError::DeviceError;
};

}  // namespace flash::sim::cuda
