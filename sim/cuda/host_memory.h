#pragma once
#include <cstddef>
#include <memory>
#include <optional>

#include "sim/cuda/device_error.h"
#include "sim/cuda/pinned_array.h"

namespace flash::sim::cuda {

/// Memory of the host that copies to and from a device use: pinned where the system lets it, which is
/// limited; other memory does as well. It grows and then forgets what was in it.
class HostMemory {
 public:
  void hold(std::size_t bytes) {
    if (bytes <= size_) return;
    pinned_.reset();
    pageable_.reset();
    size_ = 0;
    try {
      pinned_.emplace(bytes);
      data_ = pinned_->data();
    } catch (const OutOfMemory&) {
      pageable_ = std::make_unique<char[]>(bytes);
      data_ = pageable_.get();
    }
    size_ = bytes;
  }
  char* data() const { return data_; }

 private:
  std::optional<PinnedArray<char>> pinned_;
  std::unique_ptr<char[]> pageable_;
  char* data_ = nullptr;
  std::size_t size_ = 0;
};

}  // namespace flash::sim::cuda
