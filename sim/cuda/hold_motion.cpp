#include "sim/cuda/hold_motion.h"

#include <algorithm>
#include <utility>

#include "sim/step/springs.h"

namespace flash::sim::cuda {

using data::Points;

namespace {

/// The vertices held at the end of a step, as begin_step of sim/step/contact_set.h takes them.
std::vector<HeldVertex> held_at(const Environment& environment, double time) {
  std::vector<HeldVertex> all;
  std::vector<int> place(static_cast<std::size_t>(environment.state.positions.rows()), -1);
  for (std::size_t k = 0; k < environment.holds.size(); ++k) {
    const Hold& hold = environment.holds[k];
    const HeldVertices& held = environment.state.held[k];
    if (held.vertices.empty()) continue;
    const Eigen::Isometry3d frame = frame_pose(environment, hold.frame, time);
    const Points places = held_places(hold, held, time);
    for (std::size_t v = 0; v < held.vertices.size(); ++v) {
      if (!is_rigid(hold, v)) continue;
      int& at = place[static_cast<std::size_t>(held.vertices[v])];
      if (at < 0) {
        at = static_cast<int>(all.size());
        all.push_back({held.vertices[v], {false, false, false}, Eigen::Vector3d::Zero(), {-1, -1, -1}});
      }
      HeldVertex& own = all[static_cast<std::size_t>(at)];
      const Eigen::Vector3d target = frame * places.row(static_cast<Eigen::Index>(v)).transpose();
      for (int axis = 0; axis < 3; ++axis) {
        if (!hold.axes[static_cast<std::size_t>(axis)]) continue;
        own.axes[static_cast<std::size_t>(axis)] = true;
        own.holds[static_cast<std::size_t>(axis)] = static_cast<int>(k);
        own.target[axis] = target[axis];
      }
    }
  }
  return all;
}

/// Of places at the start, in the middle and at the end of a step (HeldVertex).
Eigen::Vector3d bow_of(const Eigen::Vector3d& start, const Eigen::Vector3d& middle,
                       const Eigen::Vector3d& end) {
  return 4 * middle - 2 * (start + end);
}

/// The vertices held over a step, by which the holds have changed already.
std::vector<HeldVertex> held_over(const Environment& environment, double start, double end) {
  std::vector<HeldVertex> held = held_at(environment, end);
  const std::vector<HeldVertex> before = held_at(environment, start),
                                between = held_at(environment, 0.5 * (start + end));
  for (std::size_t k = 0; k < held.size(); ++k)
    held[k].bow = bow_of(before[k].target, between[k].target, held[k].target);
  return held;
}

/// Where the stiffness of each hold begins among those of an environment.
std::vector<int> first_entries(const Environment& environment) {
  std::vector<int> first = {0};
  for (const Hold& hold : environment.holds)
    first.push_back(first.back() + static_cast<int>(hold.stiffness.size()));
  return first;
}

/// Whether the hold acts in the step from `start` to `end` [s].
bool is_closed(const Hold& hold, double start, double end) {
  const double middle = 0.5 * (start + end);
  return hold.from <= middle && middle < hold.to;
}

}  // namespace

int steps_before_a_hold_closes(const Environment& environment, double time_step, int most) {
  double time = environment.state.time;
  for (int k = 0; k < most; ++k, time += time_step)
    for (const Hold& hold : environment.holds)
      if (k > 0 && is_closed(hold, time, time + time_step) && !is_closed(hold, time - time_step, time))
        return k;
  return most;
}

bool closes_next(const Environment& environment, double time_step) {
  const double time = environment.state.time;
  const std::vector<HeldVertices>& held = environment.state.held;
  for (std::size_t k = 0; k < environment.holds.size(); ++k)
    if (is_closed(environment.holds[k], time, time + time_step) &&
        (k >= held.size() || held[k].vertices.empty()))
      return true;
  return false;
}

HoldMotion motion_of_holds(Environment& environment, double time_step, int steps) {
  HoldMotion motion;
  const double start = environment.state.time;
  for (int k = 0; k < steps; ++k) {
    const double time = environment.state.time + time_step;
    update_holds(environment, time);
    motion.push_back(held_over(environment, environment.state.time, time));
    environment.state.time = time;
  }
  environment.state.time = start;
  return motion;
}

std::shared_ptr<const SpringMotions> motion_of_springs(Environment environment, double time_step, int steps) {
  if (first_soft_hold(environment) == nullptr) return nullptr;
  const std::vector<int> first = first_entries(environment);
  auto motion = std::make_shared<SpringMotions>();
  for (int k = 0; k < steps; ++k) {
    const double time = environment.state.time + time_step;
    update_holds(environment, time);
    std::vector<SpringMotion>& step = motion->emplace_back();
    const std::vector<Spring> springs = springs_of(environment, time),
                              between = springs_of(environment, time - 0.5 * time_step);
    for (std::size_t s = 0; s < springs.size(); ++s) {
      const Spring& spring = springs[s];
      step.push_back({spring.vertex,
                      spring.hold,
                      first[static_cast<std::size_t>(spring.hold)] + spring.entry,
                      {spring.acts[0] > 0, spring.acts[1] > 0, spring.acts[2] > 0},
                      spring.before,
                      spring.place,
                      bow_of(spring.before, between[s].place, spring.place)});
    }
    environment.state.time = time;
  }
  return motion;
}

ReplayEnvironment replay_environment(const Environment& environment, std::shared_ptr<const HoldMotion> holds,
                                     std::shared_ptr<const SpringMotions> springs) {
  ReplayEnvironment replay;
  replay.material = environment.materials[0];
  replay.gravity = environment.gravity;
  replay.loads = environment.loads;
  replay.holds = std::move(holds);
  replay.hold_count = static_cast<int>(environment.holds.size());
  replay.springs = std::move(springs);
  for (const Hold& hold : environment.holds)
    replay.stiffness.insert(replay.stiffness.end(), hold.stiffness.begin(), hold.stiffness.end());
  replay.obstacles = environment.obstacles;
  replay.schedule = environment.schedule;
  replay.time = environment.state.time;
  replay.positions = environment.state.positions;
  replay.velocities = environment.state.velocities;
  replay.bristles = environment.state.bristles;
  return replay;
}

}  // namespace flash::sim::cuda
