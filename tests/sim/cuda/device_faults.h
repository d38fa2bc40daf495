#pragma once
#include <cstddef>
#include <vector>

namespace flash::sim::cuda {

/// A kernel that traps: whatever this process asks of the first device from now on fails, as where the device
/// is lost.
void lose_device();

/// Holds all of the first device's free memory but `left` bytes, or a little less.
class FullDevice {
 public:
  explicit FullDevice(std::size_t left);
  ~FullDevice();
  FullDevice(const FullDevice&) = delete;

 private:
  std::vector<void*> pieces_;
};

}  // namespace flash::sim::cuda
