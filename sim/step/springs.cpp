#include "sim/step/springs.h"

#include <algorithm>
#include <array>

namespace flash::sim {

using data::Points;

namespace {

/// The axes of each vertex along which a hold carries it rigidly.
std::vector<std::array<bool, 3>> carried_axes(const Environment& environment) {
  std::vector<std::array<bool, 3>> carried(static_cast<std::size_t>(environment.state.positions.rows()));
  for (std::size_t k = 0; k < environment.state.held.size(); ++k) {
    const std::vector<int>& vertices = environment.state.held[k].vertices;
    for (std::size_t v = 0; v < vertices.size(); ++v)
      for (std::size_t axis = 0; axis < 3 && is_rigid(environment.holds[k], v); ++axis)
        if (environment.holds[k].axes[axis]) carried[static_cast<std::size_t>(vertices[v])][axis] = true;
  }
  return carried;
}

Points places_at(const Environment& environment, std::size_t hold, double time) {
  const Hold& own = environment.holds[hold];
  const Eigen::Isometry3d frame = frame_pose(environment, own.frame, time);
  return ((held_places(own, environment.state.held[hold], time) * frame.linear().transpose()).rowwise() +
          frame.translation().transpose());
}

}  // namespace

std::vector<Spring> springs_of(const Environment& environment, double time) {
  std::vector<Spring> springs;
  if (first_soft_hold(environment) == nullptr) return springs;
  const auto carried = carried_axes(environment);
  for (std::size_t k = 0; k < environment.state.held.size(); ++k) {
    const Hold& hold = environment.holds[k];
    const std::vector<int>& vertices = environment.state.held[k].vertices;
    if (hold.stiffness.size() == 0 || vertices.empty()) continue;
    const Points before = places_at(environment, k, environment.state.time),
                 places = places_at(environment, k, time);
    for (std::size_t v = 0; v < vertices.size(); ++v) {
      if (is_rigid(hold, v)) continue;
      const auto row = static_cast<Eigen::Index>(v);
      const std::array<bool, 3>& axes = carried[static_cast<std::size_t>(vertices[v])];
      springs.push_back({vertices[v], static_cast<int>(k), static_cast<int>(v), hold.stiffness[row],
                         Eigen::Array3d(!axes[0], !axes[1], !axes[2]), before.row(row).transpose(),
                         places.row(row).transpose()});
    }
  }
  return springs;
}

const Hold* first_soft_hold(const Environment& environment) {
  const auto found = std::find_if(environment.holds.begin(), environment.holds.end(),
                                  [](const Hold& hold) { return hold.stiffness.size() > 0; });
  return found == environment.holds.end() ? nullptr : &*found;
}

}  // namespace flash::sim
