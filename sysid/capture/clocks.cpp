#include "sysid/capture/clocks.h"

#include <algorithm>
#include <cstdio>

#include "data/files/error.h"
#include "data/files/text.h"

namespace flash::sysid {

std::vector<std::string> compare_clocks(const std::vector<double>& times, const data::Trajectory& trajectory,
                                        const std::string& path) {
  if (times.empty() || trajectory.times.empty()) return {};
  constexpr double rounding = 1e-6;  // of the files [s]
  const double begin = trajectory.times.front(), end = trajectory.times.back();
  const auto outside = static_cast<std::size_t>(std::count_if(
      times.begin(), times.end(), [&](double t) { return t < begin - rounding || t > end + rounding; }));
  const auto span = [](double from, double to) {
    char text[64];
    std::snprintf(text, sizeof text, "%.3f to %.3f s", from, to);
    return std::string(text);
  };
  const std::string spans =
      "the frames are of " + span(times.front(), times.back()) + ", the trajectory of " + span(begin, end);
  // Whether stamps in other units would bring them together.
  const auto come_together = [&](double factor) {
    return 2 * std::count_if(times.begin(), times.end(),
                             [&](double t) { return factor * t >= begin && factor * t <= end; }) >
           static_cast<std::ptrdiff_t>(times.size());
  };
  const std::string units =
      come_together(1e3) || come_together(1e-3) || come_together(1e6) || come_together(1e-6)
          ? ", in seconds both: are one's stamps in milliseconds or microseconds?"
          : "";
  const std::string of_all = std::to_string(outside) + " of " + std::to_string(times.size()) + " frames";
  if (2 * outside > times.size())
    throw data::InputError(path + ": " + spans + ": " + of_all +
                           " are outside of it, expected one clock for both (--times)" + units);
  std::vector<std::string> notices;
  constexpr double slowest = 10;  // no motion of cloth is seen less often [s]
  if (times.size() > 1)
    if (const double step = (times.back() - times.front()) / static_cast<double>(times.size() - 1);
        step > slowest)
      notices.push_back(path + ": " + spans + ", " + data::format_short(step) +
                        " s from one frame to the next: are the stamps in milliseconds or microseconds?");
  if (outside > 0)
    notices.push_back(path + ": " + spans + ": " + of_all +
                      " are outside of it, and the gripper is taken to stand still there");
  else if (times.size() > 1 && times.back() - times.front() < 2.0 / 3 * (end - begin))
    notices.push_back(path + ": " + spans +
                      ", far longer: are the times of the frames right (--times)? A wrong rate takes the arm "
                      "for cloth");
  return notices;
}

}  // namespace flash::sysid
