#pragma once
#include <cstdint>
#include <vector>

#include "sim/device.h"

namespace flash::sim {

enum class NumberType { float32, float64 };

/// Numbers in the memory of a device, as DLPack describes them. It does not own them.
struct Tensor {
  const void* data = nullptr;
  NumberType type = NumberType::float64;
  std::vector<std::int64_t> shape{};
  std::vector<std::int64_t> strides{};  ///< in numbers; empty: dense, the last index fastest
  Device device = Device::cpu;
  int device_number = 0;

  bool empty() const { return data == nullptr; }
};

}  // namespace flash::sim
