#include "sim/device.h"

#include <algorithm>
#include <charconv>
#include <stdexcept>
#include <string_view>

#include "data/files/error.h"
#ifdef FLASH_HAVE_CUDA
#include "sim/cuda/devices.h"
#endif

namespace flash::sim {
namespace {

/// The devices of "0,2".
std::vector<int> numbers_in(const std::string& name, std::string_view list,
                            const std::vector<std::string>& why_not) {
  const int count = static_cast<int>(why_not.size());
  const auto fail = [&](const std::string& found, const std::string& expected) {
    throw data::InputError("--device " + name + ": found " + found + ", expected " + expected);
  };
  std::vector<int> numbers;
  while (true) {
    const std::string_view word = list.substr(0, list.find(','));
    int number = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), number);
    if (error != std::errc() || end != word.data() + word.size() || number < 0)
      fail("\"" + std::string(word) + "\"", "numbers of devices, as cuda:0,2, or cuda:all");
    if (number >= count)
      fail("no CUDA device " + std::to_string(number),
           count == 1 ? "0, the only one" : "0 to " + std::to_string(count - 1));
    if (const std::string& why = why_not[static_cast<std::size_t>(number)]; !why.empty())
      throw data::InputError("--device " + name + ": device " + std::to_string(number) + " cannot be used (" +
                             why + ")");
    if (std::find(numbers.begin(), numbers.end(), number) != numbers.end())
      fail(std::to_string(number) + " twice", "each device once");
    numbers.push_back(number);
    if (word.size() == list.size()) return numbers;
    list.remove_prefix(word.size() + 1);
  }
}

}  // namespace

std::string why_no_cuda() {
#ifdef FLASH_HAVE_CUDA
  const std::string why = cuda::why_no_device();
  return why.empty() ? why : "no CUDA device can be used (" + why + ")";
#else
  return "this program was built without CUDA";
#endif
}

DeviceRates device_rates(int cuda_device) {
#ifdef FLASH_HAVE_CUDA
  const cuda::Rates rates = cuda::rates_of(cuda_device);
  return {rates.name, rates.copied_bytes, rates.single_flops};
#else
  throw std::runtime_error("device " + std::to_string(cuda_device) + ": " + why_no_cuda());
#endif
}

DeviceChoice choose_device(const std::string& name) {
  if (name == "cpu") return {};
  std::vector<std::string> why_not;
#ifdef FLASH_HAVE_CUDA
  for (int device = 0; device < cuda::device_count(); ++device) why_not.push_back(cuda::why_not(device));
#endif
  return choose_device(name, why_not, why_no_cuda());
}

DeviceChoice choose_device(const std::string& name, const std::vector<std::string>& why_not,
                           const std::string& why_none) {
  if (name == "cpu") return {};
  if (name == "auto") return {why_none.empty() ? Device::cuda : Device::cpu};
  const std::string numbered = "cuda:";
  if (name != "cuda" && !name.starts_with(numbered))
    throw data::InputError("--device: found \"" + name +
                           "\", expected auto, cpu, cuda, cuda:all or numbers of devices, as cuda:0,2");
  DeviceChoice choice{Device::cuda};
  if (!why_not.empty() && name == numbered + "all") {
    for (std::size_t device = 0; device < why_not.size(); ++device)
      if (why_not[device].empty()) choice.cuda_devices.push_back(static_cast<int>(device));
    if (!choice.cuda_devices.empty()) return choice;
  } else if (!why_not.empty() && name != "cuda") {
    choice.cuda_devices = numbers_in(name, std::string_view(name).substr(numbered.size()), why_not);
    return choice;
  }
  if (!why_none.empty())
    throw data::InputError("--device " + name + ": " + why_none + "; use --device cpu or auto");
  return choice;
}

}  // namespace flash::sim
