#include "sim/device_shares.h"

#include <algorithm>

#include "data/machine/parallel.h"
#include "sim/device_error.h"

namespace flash::sim {

void DeviceFailures::add(const std::string& why, const std::vector<int>& environments) {
  const std::scoped_lock lock(mutex_);
  if (environments_.empty()) why_ = why;
  environments_.insert(environments_.end(), environments.begin(), environments.end());
}

void DeviceFailures::throw_any() const {
  if (!environments_.empty())
    throw DeviceError(why_, std::vector<std::size_t>(environments_.begin(), environments_.end()));
}

namespace {

/// The share of one device, in parts that fit into its memory.
void work_in_parts(const std::vector<int>& share, DeviceFailures& failures,
                   const std::function<void(const std::vector<int>&)>& work) {
  std::size_t at_once = share.size();
  for (std::size_t begin = 0; begin < share.size();) {
    const std::size_t count = std::min(at_once, share.size() - begin);
    const auto from = share.begin() + static_cast<std::ptrdiff_t>(begin);
    const std::vector<int> part(from, from + static_cast<std::ptrdiff_t>(count));
    try {
      work(part);
    } catch (const OutOfDeviceMemory& error) {
      if (count > 1) {
        at_once = (count + 1) / 2;
        continue;
      }
      failures.add(error.why(), part);
    } catch (const DeviceError& error) {
      failures.add(error.why(), part);
    }
    begin += count;
  }
}

}  // namespace

void share_out(std::size_t devices, const std::vector<int>& environments, DeviceFailures& failures,
               const std::function<void(std::size_t, const std::vector<int>&)>& work) {
  const std::size_t count = std::min(devices, environments.size());
  std::vector<std::vector<int>> shares(count);
  for (std::size_t k = 0; k < environments.size(); ++k) shares[k % count].push_back(environments[k]);
  data::for_each_in_parallel(count, static_cast<int>(count), [&](std::size_t device) {
    work_in_parts(shares[device], failures, [&](const std::vector<int>& part) { work(device, part); });
  });
}

}  // namespace flash::sim
