#include "apps/sysid/frame_times.h"

#include <cmath>
#include <optional>
#include <string_view>

#include "data/files/error.h"
#include "data/files/text.h"
#include "data/recording/frame_files.h"

namespace flash {
namespace {

constexpr double kFastest = 1e5;  // frames a second: no camera has more

data::InputError times_error(const std::string& times, const char* expected) {
  return data::InputError("--times: found \"" + times + "\", expected " + expected);
}

std::vector<double> even_times(const std::string& times, std::size_t frames) {
  const std::vector<std::string_view> parts = data::split(times, ":");
  const std::optional<double> rate = parts.size() >= 2 ? data::parse_number(parts[1]) : std::nullopt;
  const std::optional<double> start = parts.size() == 3 ? data::parse_number(parts[2]) : 0.0;
  if (!rate || !start || parts.size() > 3 || !(*rate > 0 && *rate <= kFastest) || !std::isfinite(*start))
    throw times_error(times, "rate:HZ, rate:HZ:START or a CSV file with a column t");
  std::vector<double> result;
  for (std::size_t i = 0; i < frames; ++i) {
    result.push_back(*start + static_cast<double>(i) / *rate);
    if (!std::isfinite(result[i]) || (i > 0 && !(result[i] > result[i - 1])))
      throw times_error(times, "a rate by which every frame is later than the one before");
  }
  return result;
}

}  // namespace

std::vector<double> frame_times(const std::string& times, const std::vector<std::string>& files) {
  if (!times.starts_with("rate:")) return data::load_frame_times(times, files.size());
  std::vector<double> even = even_times(times, files.size());
  if (const std::string gap = data::gap_in_names(files); !gap.empty())
    throw data::InputError("--times: found \"" + times + "\", but " + gap +
                           ": expected a CSV file with the time of each frame that is there");
  return even;
}

}  // namespace flash
