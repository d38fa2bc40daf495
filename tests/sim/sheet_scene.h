#pragma once
#include <cmath>

#include "data/mesh/procedural_mesh.h"
#include "sim/newton/solver.h"

namespace flash::sim {

/// A sheet at rest in its rest shape, without obstacles or supports.
inline Environment environment_of(const Sheet& sheet) {
  Environment environment;
  environment.state.positions = sheet.rest.vertices;
  environment.state.velocities = data::Points::Zero(sheet.rest.vertices.rows(), 3);
  return environment;
}

/// Adds a frame that follows `trajectory`, sampled every `time_step` to its end, to the environment's
/// schedule. Returns its number.
inline int add_frame(Environment& environment, const data::Trajectory& trajectory, double time_step = 0.01) {
  Schedule schedule = environment.schedule ? *environment.schedule : Schedule{0.0, time_step, {}};
  const int steps = static_cast<int>(std::ceil(trajectory.times.back() / time_step));
  schedule.frames.push_back(make_schedule({&trajectory, 1}, 0.0, time_step, steps)->frames[0]);
  environment.schedule = std::make_shared<const Schedule>(schedule);
  return static_cast<int>(schedule.frames.size()) - 1;
}

/// A gripper that carries `vertices` along `trajectory` from the start.
inline Hold gripped(Environment& environment, std::vector<int> vertices, const data::Trajectory& trajectory,
                    double time_step = 0.01) {
  return {.vertices = std::move(vertices), .frame = add_frame(environment, trajectory, time_step)};
}

/// A vertex held at `position` in some axes.
inline Hold support(int vertex, const std::array<bool, 3>& axes, const Eigen::Vector3d& position) {
  return {.vertices = {vertex}, .axes = axes, .targets = position.transpose()};
}

/// A path at one speed from the pose at time 0 to the pose at `seconds`.
inline data::Trajectory straight_path(const Eigen::Vector3d& from, const Eigen::Vector3d& to,
                                      double seconds) {
  return {{0, seconds},
          {Eigen::Isometry3d(Eigen::Translation3d(from)), Eigen::Isometry3d(Eigen::Translation3d(to))}};
}

inline Sheet small_sheet(int cells = 6, double side = 0.12) {
  return make_sheet(data::rectangle({.width = side,
                                     .height = side,
                                     .cells_x = cells,
                                     .cells_y = cells,
                                     .pattern = data::DiagonalPattern::jittered}));
}

}  // namespace flash::sim
