#pragma once
#include <stdexcept>

namespace flash::sim::cuda {

/// The device's memory does not suffice.
struct OutOfMemory : std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace flash::sim::cuda
