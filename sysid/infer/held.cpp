#include "sysid/infer/held.h"

#include <algorithm>
#include <cmath>

#include "sysid/replay/grasp_mesh.h"
#include "sysid/replay/recorded_grasp.h"

namespace flash::sysid {
namespace {

/// Factors within which friction and a stiffness that is not searched are known, at one standard deviation.
/// Chosen: a friction that is wrong by 0.2 moves D of a strip by 10 %, unseen. The factors were not varied.
constexpr double kFriction = 2, kStiffness = 2;
/// Factor within which a weight is known that was not measured. Chosen: not varied. Of 23 towels whose weight
/// is 10 % off, all 21 claims of D hold or are told (docs/validation/grasp.md).
constexpr double kWeight = 1.1;
constexpr double kPinch = 0.2;  // Angles of the ridge that two fingers fold [rad]. Chosen: not varied.
/// Where fingers end on a sheet [m]. Chosen: not varied. Of 24 towels whose patch is 3 mm larger, 23 claims
/// of D hold or are told (docs/validation/grasp.md).
constexpr double kPatch = 0.003;
/// Stiffness of pads at one standard deviation from rigid ones [N/m^3]. Chosen: as of soft silicone, 3e5 Pa
/// over 3 mm; not varied.
constexpr double kSoftPads = 1e8;

bool is_searched(const std::string& name, const GridSettings& grid) {
  return std::any_of(grid.axes.begin(), grid.axes.end(),
                     [&](const Axis& axis) { return axis.name == name && axis.values.size() > 1; });
}

/// Known, or stated with a deviation.
bool is_stated(const std::string& name, const GridSettings& grid) {
  return is_searched(name, grid) || grid.deviations.contains(name) ||
         std::any_of(grid.fixed.begin(), grid.fixed.end(),
                     [&](const Axis& axis) { return axis.name == name; });
}

const Axis* axis_of(const std::string& name, const GridSettings& grid) {
  for (const std::vector<Axis>* axes : {&grid.fixed, &grid.axes})
    for (const Axis& axis : *axes)
      if (axis.name == name) return &axis;
  return nullptr;
}

/// One deviation to both sides; by a factor where that would leave what is possible.
std::array<double, 2> within(double value, double deviation, double lowest) {
  if (value - deviation > lowest || value <= 0) return {value - deviation, value + deviation};
  return {value * value / (value + deviation), value + deviation};
}

/// The first grasp that folds the sheet to a ridge before it moves.
const data::RecordedGrasp* pinch_of(const std::vector<Replay>& replays) {
  for (const Replay& replay : replays)
    for (const data::RecordedGrasp& grasp : replay.recording.grasps)
      if (grasp.from <= replay.beginning && shape_of(grasp, replay.settings) == data::GraspShape::pinch)
        return &grasp;
  return nullptr;
}

/// The size that all clamped patches at corners have; empty where they differ, or there are none.
std::optional<double> common_grasp_size(const std::vector<Replay>& replays) {
  std::optional<double> common;
  for (const Replay& replay : replays) {
    const std::optional<double> size = grasp_size(replay.recording, replay.settings);
    if (!size || (common && std::abs(*common - *size) > 1e-9)) return std::nullopt;
    common = size;
  }
  return common;
}

}  // namespace

double HeldParameter::nearer(std::size_t side, double share) const {
  const double end = values[side];
  if (share == 1) return end;
  return values[0] > 0 ? at * std::pow(end / at, share) : at + share * (end - at);
}

std::vector<HeldParameter> held_parameters(const GridSettings& grid, const std::vector<Replay>& replays,
                                           const std::vector<double>& at) {
  const ReplayCandidate candidate = candidate_at(at, grid);
  std::vector<HeldParameter> held;
  for (const Parameter& parameter : known_parameters()) {
    const auto stated = grid.deviations.find(parameter.name);
    const Axis* const axis = axis_of(parameter.name, grid);
    if (stated == grid.deviations.end() || axis == nullptr || axis->values.size() != 1) continue;
    const double value = axis->values.front();
    held.push_back({parameter.name, value, within(value, stated->second, parameter.low)});
  }
  const auto add = [&](const char* name, double factor) {
    if (is_stated(name, grid)) return;
    const double value = parameter_named(name).get(candidate, grid.base);
    held.push_back({name, value, {value / factor, factor * value}});
  };
  if (std::any_of(replays.begin(), replays.end(), [](const Replay& r) { return r.recording.has_table; }))
    add("friction", kFriction);
  if (candidate.solid) {
    add("density", kWeight);
  } else {
    add("areal_density", kWeight);
    if (is_searched("bending", grid)) add("young", kStiffness);
    if (is_searched("young", grid)) add("bending", kStiffness);
  }
  double yaw = 0, height = 0;
  for (const Replay& replay : replays) {
    yaw = std::max(yaw, replay.recording.nuisance.start_yaw);
    height = std::max(height, replay.recording.nuisance.table_height);
  }
  const auto add_bound = [&](const char* name, double bound) {
    if (bound > 0 && !is_stated(name, grid))
      held.push_back({name, 0, {-bound / std::sqrt(3.0), bound / std::sqrt(3.0)}, false});
  };
  const auto add_angle = [&](const char* name, double recorded) {
    const Axis* const axis = axis_of(name, grid);
    const double angle = axis != nullptr ? axis->values.front() : recorded;
    if (!is_stated(name, grid)) held.push_back({name, angle, {angle - kPinch, angle + kPinch}, false});
  };
  if (const data::RecordedGrasp* const pinch = pinch_of(replays)) {
    if (pinch->direction.isZero()) add_angle("grasp_direction", 0);
    add_angle("grasp_pitch", pinch->pitch);
  }
  if (const std::optional<double> size = common_grasp_size(replays)) {
    const double at_size = candidate.nuisance.grasp_size.value_or(*size);
    if (!is_stated("grasp_size", grid))
      held.push_back({"grasp_size", at_size, within(at_size, kPatch, 0), false});
    const bool slopes = std::any_of(replays.begin(), replays.end(),
                                    [](const Replay& replay) { return replay.settings.clamp_slopes; });
    if (!slopes && !is_stated("grasp_stiffness", grid) && !candidate.nuisance.grasp_stiffness)
      held.push_back({"grasp_stiffness", rigid_pads, {kSoftPads, rigid_pads}, false});
  }
  add_bound("start_yaw", yaw);
  add_bound("table_height", height);
  return held;
}

std::vector<HeldParameter> held_parameters(const GridSettings& grid, const std::vector<Replay>& replays) {
  std::vector<double> first;
  for (const Axis& axis : grid.axes) first.push_back(axis.values.front());
  return held_parameters(grid, replays, first);
}

ReplayCandidate candidate_with(const std::vector<double>& values, const GridSettings& grid,
                               const std::string& name, double value) {
  GridSettings held = grid;
  held.centres.push_back({name, {value}, false});  // the last word
  return candidate_at(values, held);
}

}  // namespace flash::sysid
