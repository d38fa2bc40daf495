#include "sysid/infer/held.h"

#include <algorithm>
#include <cmath>

namespace flash::sysid {
namespace {

bool is_known(const std::string& name, const GridSettings& grid) {
  const auto named = [&](const Axis& axis) { return axis.name == name; };
  return std::any_of(grid.fixed.begin(), grid.fixed.end(), named) ||
         std::any_of(grid.axes.begin(), grid.axes.end(),
                     [&](const Axis& axis) { return named(axis) && axis.values.size() > 1; });
}

}  // namespace

std::vector<HeldParameter> held_parameters(const GridSettings& grid, const std::vector<Replay>& replays) {
  std::vector<double> first;
  for (const Axis& axis : grid.axes) first.push_back(axis.values.front());
  const ReplayCandidate candidate = candidate_at(first, grid);
  const double friction = candidate.solid ? candidate.solid->friction : candidate.material.friction;
  std::vector<HeldParameter> held;
  const auto add = [&](const char* name, double low, double high) {
    if (!is_known(name, grid)) held.push_back({name, {low, high}});
  };
  if (std::any_of(replays.begin(), replays.end(), [](const Replay& r) { return r.recording.has_table; }))
    add("friction", friction / 2, 2 * friction);
  double yaw = 0, height = 0;
  for (const Replay& replay : replays) {
    yaw = std::max(yaw, replay.recording.nuisance.start_yaw);
    height = std::max(height, replay.recording.nuisance.table_height);
  }
  const auto add_bound = [&](const char* name, double bound) {
    if (bound > 0 && !is_known(name, grid))
      held.push_back({name, {-bound / std::sqrt(3.0), bound / std::sqrt(3.0)}, false});
  };
  add_bound("start_yaw", yaw);
  add_bound("table_height", height);
  return held;
}

ReplayCandidate candidate_with(const std::vector<double>& values, const GridSettings& grid,
                               const std::string& name, double value) {
  GridSettings held = grid;
  held.fixed.push_back({name, {value}, false});
  return candidate_at(values, held);
}

}  // namespace flash::sysid
