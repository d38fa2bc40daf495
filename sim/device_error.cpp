#include "sim/device_error.h"

#include <algorithm>
#include <utility>

namespace flash::sim {
namespace {

/// "environment 3", "environments 3, 5 to 9": runs of numbers, the first few.
std::string text_of(std::vector<std::size_t> numbers, const std::string& noun) {
  constexpr int most_runs = 4;
  std::sort(numbers.begin(), numbers.end());
  std::string text = noun + (numbers.size() > 1 ? "s " : " ");
  std::size_t begin = 0;
  for (int run = 0; begin < numbers.size(); ++run) {
    if (run == most_runs) return text + " and " + std::to_string(numbers.size() - begin) + " more";
    std::size_t end = begin + 1;
    while (end < numbers.size() && numbers[end] == numbers[end - 1] + 1) ++end;
    text += (run > 0 ? ", " : "") + std::to_string(numbers[begin]);
    if (end > begin + 1) text += (end > begin + 2 ? " to " : ", ") + std::to_string(numbers[end - 1]);
    begin = end;
  }
  return text;
}

}  // namespace

DeviceError::DeviceError(std::string why, std::vector<std::size_t> without_result, const std::string& noun)
    : std::runtime_error(without_result.empty() ? why
                                                : why + "; no result of " + text_of(without_result, noun)),
      why_(std::move(why)),
      without_result_(std::move(without_result)) {}

DeviceError DeviceError::renumbered(const std::function<std::size_t(std::size_t)>& number_of,
                                    const std::string& noun) const {
  std::vector<std::size_t> numbers;
  for (const std::size_t number : without_result_) numbers.push_back(number_of(number));
  return DeviceError(why_, std::move(numbers), noun);
}

}  // namespace flash::sim
