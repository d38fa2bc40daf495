#include "sysid/emulate/focused_axes.h"

#include <algorithm>

namespace flash::sysid {
namespace {

std::vector<double> focused(const std::vector<double>& values, std::size_t best) {
  std::vector<double> kept;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const std::size_t away = i > best ? i - best : best - i;
    const bool is_power_of_two = (away & (away - 1)) == 0;  // or none
    if (is_power_of_two || i == 0 || i + 1 == values.size()) kept.push_back(values[i]);
  }
  return kept;
}

/// `place` of the best value of each axis.
template <class Place>
std::vector<Axis> focused_at(std::vector<Axis> axes, const Place& place) {
  if (count_candidates(axes) <= static_cast<double>(most_emulated)) return axes;
  for (std::size_t k = 0; k < axes.size(); ++k) axes[k].values = focused(axes[k].values, place(k));
  return axes;
}

}  // namespace

std::vector<Axis> focused(const std::vector<Axis>& axes, const std::vector<double>& best) {
  return focused_at(axes, [&](std::size_t k) {
    const std::vector<double>& values = axes[k].values;
    return static_cast<std::size_t>(std::find(values.begin(), values.end(), best[k]) - values.begin());
  });
}

std::vector<Axis> most_focused(const std::vector<Axis>& axes) {
  return focused_at(axes, [&](std::size_t k) {
    const std::vector<double>& values = axes[k].values;
    std::size_t most = 0;
    for (std::size_t i = 1; i < values.size(); ++i)
      if (focused(values, i).size() > focused(values, most).size()) most = i;
    return most;
  });
}

}  // namespace flash::sysid
