#include "sysid/lattice.h"

#include <algorithm>
#include <cmath>

namespace flash::sysid {
namespace {

constexpr double kSame = 1e-9;  // of a width

double distance(const Axis& axis, double from, double to) {
  return axis.logarithmic ? std::log(to / from) : to - from;
}

double moved(const Axis& axis, double value, double by) {
  return axis.logarithmic ? value * std::exp(by) : value + by;
}

double cell_of(const Axis& axis) {
  return distance(axis, axis.values.front(), axis.values.back()) /
         static_cast<double>(axis.values.size() - 1);
}

}  // namespace

std::vector<Axis> lattice(const Extent& extent, const std::vector<Axis>& searched, int count) {
  std::vector<Axis> axes = searched;
  for (std::size_t k = 0; k < axes.size(); ++k) {
    Axis& axis = axes[k];
    if (axis.values.size() < 2) continue;
    const double first = axis.values.front(), last = axis.values.back();
    const auto [low, high] = extent[k];
    if (distance(axis, low, high) > cell_of(axis)) continue;
    axis.values.clear();
    for (int i = 0; i < count; ++i) {
      const double share = static_cast<double>(i) / (count - 1);
      const double value = axis.logarithmic ? low * std::pow(high / low, share) : low + share * (high - low);
      axis.values.push_back(std::clamp(value, first, last));
    }
  }
  return axes;
}

Extent next_lattice(const Extent& extent, const Extent& zoomed, const GridVerdict& verdict,
                    const std::vector<Axis>& searched) {
  constexpr double kPart = 0.5 - kSame;
  Extent next = next_extent(zoomed, verdict, searched);
  bool holds = true;
  for (std::size_t k = 0; k < searched.size(); ++k) {
    const Axis& axis = searched[k];
    if (axis.values.size() < 2) continue;
    const auto [low, high] = extent[k];
    const auto [from, to] = *verdict.parameters[k].interval95;
    const double width = distance(axis, low, high), first = axis.values.front(), last = axis.values.back();
    const auto leaves = [&](double end, double side, double range) {
      return std::abs(distance(axis, end, side)) <= kSame * width &&
             std::abs(distance(axis, side, range)) > kSame * width;
    };
    const bool below = leaves(from, low, first), above = leaves(to, high, last);
    if (below) next[k][0] = std::max(first, moved(axis, low, -width));
    if (above) next[k][1] = std::min(last, moved(axis, high, width));
    holds = holds && !below && !above && distance(axis, zoomed[k][0], zoomed[k][1]) >= kPart * width;
  }
  return holds ? extent : next;
}

}  // namespace flash::sysid
