#pragma once
#include <cstddef>

namespace flash::sim::cuda {

/// Hands out parts of a piece of memory, one behind the other. Without memory it only counts.
class DeviceArena {
 public:
  explicit DeviceArena(char* begin) : begin_(begin) {}

  /// Room for so many numbers; null for none.
  template <typename Number>
  Number* take(std::size_t count) {
    if (count == 0) return nullptr;
    const std::size_t at = used_;
    used_ += (count * sizeof(Number) + alignment - 1) / alignment * alignment;
    return begin_ == nullptr ? nullptr : reinterpret_cast<Number*>(begin_ + at);
  }
  std::size_t used() const { return used_; }  ///< [bytes]

 private:
  static constexpr std::size_t alignment = 256;

  char* begin_;
  std::size_t used_ = 0;
};

}  // namespace flash::sim::cuda
