#pragma once
#include "sim/cuda/device_error.h"
#include "sim/device_error.h"

namespace flash::sim {

/// act(), with what a device says as errors of this program.
template <class Act>
auto ask_device(const Act& act) {
  try {
    return act();
  } catch (const cuda::OutOfMemory& error) {
    throw OutOfDeviceMemory(error.what());
  } catch (const cuda::DeviceError& error) {
    throw DeviceError(error.what());
  }
}

}  // namespace flash::sim
