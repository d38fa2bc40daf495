#pragma once
#include <cstddef>
#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

namespace flash::sim {

/// A CUDA device is lost or its memory does not suffice. What it has given before holds; what it was at has
/// no result.
class DeviceError : public std::runtime_error {
 public:
  /// `why`: of the device, as "CUDA device 0: out of memory". `without_result`: numbers of those that it was
  /// at, where they are known; `noun`: what they count.
  explicit DeviceError(std::string why, std::vector<std::size_t> without_result = {},
                       const std::string& noun = "environment");

  const std::string& why() const { return why_; }
  const std::vector<std::size_t>& without_result() const { return without_result_; }

  /// The same with other numbers, as those of the whole search for those of a batch.
  DeviceError renumbered(const std::function<std::size_t(std::size_t)>& number_of,
                         const std::string& noun = "environment") const;

 private:
  std::string why_;
  std::vector<std::size_t> without_result_;
};

/// The memory of a CUDA device does not suffice for all environments at once.
struct OutOfDeviceMemory : DeviceError {
  using DeviceError::DeviceError;
};

}  // namespace flash::sim
