#include "sysid/capture/import_cut.h"

#include <limits>

#include "data/files/error.h"
#include "data/files/text.h"

namespace flash::sysid {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

std::string seconds(double from, double until) {
  return data::format_clock(from) + " to " + data::format_clock(until) + " s";
}

data::Trajectory cut_trajectory(const data::Trajectory& whole, double from, double until) {
  data::Trajectory part;
  const auto add = [&](double time) {
    if (!part.times.empty() && !(time > part.times.back())) return;
    part.times.push_back(time);
    part.poses.push_back(data::pose_at(whole, time));
  };
  if (from >= whole.times.front()) add(from);
  for (const double time : whole.times)
    if (time >= from && time <= until) add(time);
  if (until <= whole.times.back()) add(until);
  return part;
}

}  // namespace

void cut(std::optional<double> from, std::optional<double> until, ImportSettings& settings) {
  if (!from && !until) return;
  const double low = from.value_or(-kInfinity), high = until.value_or(kInfinity);
  const char* const option = from ? "--from" : "--until";
  if (!(low < high))
    throw data::InputError("--from: found " + data::format_clock(low) + " s, expected less than --until " +
                           data::format_clock(high) + " s");
  const data::Trajectory& whole = settings.trajectory;
  if ((from && low < whole.times.front()) || low >= whole.times.back() || high <= whole.times.front())
    throw data::InputError(std::string(option) + ": found " + data::format_clock(from ? low : high) +
                           " s, expected a time of the trajectory, " +
                           seconds(whole.times.front(), whole.times.back()));
  std::vector<std::string>& frames = settings.depth.empty() ? settings.clouds : settings.depth;
  if (settings.times.empty())
    for (std::size_t i = 0; i < frames.size(); ++i)
      settings.times.push_back(static_cast<double>(i) / ImportSettings::frames_per_second);
  if (settings.times.size() != frames.size()) return;  // which the import refuses
  std::vector<std::string> kept;
  std::vector<double> times;
  for (std::size_t i = 0; i < frames.size(); ++i)
    if (settings.times[i] >= low && settings.times[i] <= high) {
      kept.push_back(frames[i]);
      times.push_back(settings.times[i]);
    }
  if (kept.empty())
    throw data::InputError(std::string(option) + ": found no frame in that time, expected one of " +
                           seconds(settings.times.front(), settings.times.back()));
  frames = kept;
  settings.times = times;
  settings.trajectory = cut_trajectory(whole, low, high);
}

}  // namespace flash::sysid
