#pragma once
#include <cstddef>
#include <functional>
#include <mutex>
#include <string>
#include <vector>

namespace flash::sim {

/// Environments of which devices gave no result, and what the first device said. Many threads may add.
class DeviceFailures {
 public:
  void add(const std::string& why, const std::vector<int>& environments);
  /// Throws a DeviceError where there are any.
  void throw_any() const;

 private:
  std::mutex mutex_;
  std::string why_;
  std::vector<int> environments_;
};

/// Shares environments out over so many devices, which work at the same time: each takes every so many-th, as
/// neighbours in a search take about as long. work(number of the device, environments), on one thread a
/// device, for all of its share; where that throws OutOfDeviceMemory in parts one after the other. What fits
/// in no part, and what a DeviceError ends, are failures.
void share_out(std::size_t devices, const std::vector<int>& environments, DeviceFailures& failures,
               const std::function<void(std::size_t device, const std::vector<int>& environments)>& work);

}  // namespace flash::sim
