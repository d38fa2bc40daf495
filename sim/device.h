#pragma once
#include <string>
#include <vector>

namespace flash::sim {

/// Where the steps of a batch run.
enum class Device { cpu, cuda };

/// Why no CUDA device can be used, in a line; empty where one can.
std::string why_no_cuda();

/// Rates of a CUDA device.
struct DeviceRates {
  std::string name;
  double copied_bytes = 0;  ///< read and written by copies between places of its memory, measured [B/s]
  double single_flops = 0;  ///< in single precision outside tensor cores, by its processors and clock [1/s]
};

/// Of a device by number. Throws std::runtime_error with the device's message.
DeviceRates device_rates(int cuda_device);

/// What an option --device names.
struct DeviceChoice {
  Device device = Device::cpu;
  std::vector<int> cuda_devices{};  ///< by number, as in BatchSettings
};

/// "cpu"; "cuda", the first CUDA device; "cuda:1" or "cuda:0,2", by number; "cuda:all", all that can be used.
/// "auto" is cuda where that can be used, else cpu. Throws data::InputError for another name and for a device
/// that is not there or cannot be used.
DeviceChoice choose_device(const std::string& name);

/// The same on a machine of other CUDA devices: `why_not` says of each why it cannot be used, empty where it
/// can; `why_none` why there are none.
DeviceChoice choose_device(const std::string& name, const std::vector<std::string>& why_not,
                           const std::string& why_none);

}  // namespace flash::sim
