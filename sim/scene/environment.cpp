#include "sim/scene/environment.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "data/files/text.h"

namespace flash::sim {

using data::Points;
using Eigen::Isometry3d;
using Eigen::Vector3d;

namespace {

constexpr double rounding = 1e-9;  ///< of a time that is a sum of steps [s]

double distance_to_box(const Vector3d& half_extents, const Vector3d& point) {
  return (point.cwiseAbs() - half_extents).cwiseMax(0.0).norm();
}

struct InReach {
  std::vector<int> vertices;
  double nearest = std::numeric_limits<double>::infinity();  ///< distance of the nearest of all [m]
};

InReach in_reach(const Reach& reach, const State& state, const Isometry3d& frame_from_base) {
  InReach found;
  const int end = reach.vertex_count < 0 ? static_cast<int>(state.positions.rows())
                                         : reach.first_vertex + reach.vertex_count;
  for (int i = reach.first_vertex; i < end; ++i) {
    const Vector3d point = frame_from_base * Vector3d(state.positions.row(i));
    const double distance = distance_to_box(reach.half_extents, point);
    found.nearest = std::min(found.nearest, distance);
    if (distance <= reach.threshold) found.vertices.push_back(i);
  }
  return found;
}

std::vector<int> vertices_in_reach(const Hold& hold, const State& state, const Isometry3d& frame_from_base) {
  InReach found = in_reach(*hold.reach, state, frame_from_base);
  if (found.vertices.empty())
    throw MissedGrasp("end effector " + hold.name + ": grasps: no vertex of " + hold.reach->object +
                      " within " + data::format_short(hold.reach->threshold) + " m of its box at " +
                      data::format_short(state.time) + " s; the nearest is " +
                      data::format_short(found.nearest) + " m away");
  return std::move(found.vertices);
}

HeldVertices take(const Hold& hold, const State& state, const Isometry3d& frame, double time) {
  const Isometry3d frame_from_base = frame.inverse();
  check_stiffness(hold);
  HeldVertices held;
  held.vertices = hold.reach ? vertices_in_reach(hold, state, frame_from_base) : hold.vertices;
  held.offsets.resize(static_cast<Eigen::Index>(held.vertices.size()), 3);
  for (std::size_t v = 0; v < held.vertices.size(); ++v)
    held.offsets.row(static_cast<Eigen::Index>(v)) =
        frame_from_base * state.positions.row(held.vertices[v]).transpose();
  held.from = std::isfinite(hold.from) ? hold.from : state.time;
  held.arrival = std::max(held.from + hold.closing_time, time);
  return held;
}

}  // namespace

double friction_on(const Obstacle& obstacle, int body, double friction) {
  const auto index = static_cast<std::size_t>(body);
  const bool told = index < obstacle.friction.size() && obstacle.friction[index] >= 0;
  return told ? obstacle.friction[index] : friction;
}

double friction_of(const Environment& environment, int body) {
  const auto solid = environment.solids.find(body);
  return solid != environment.solids.end() ? solid->second.friction
                                           : environment.materials[static_cast<std::size_t>(body)].friction;
}

double friction_between(const Environment& environment, const Obstacle& obstacle, int body) {
  return friction_on(obstacle, body, friction_of(environment, body));
}

Isometry3d frame_pose(const Environment& environment, int frame, double time) {
  return frame == base_frame ? Isometry3d::Identity() : pose_at(*environment.schedule, frame, time);
}

bool has_vertex_in_reach(const Environment& environment, const Hold& hold) {
  const State& state = environment.state;
  return !in_reach(*hold.reach, state, frame_pose(environment, hold.frame, state.time).inverse())
              .vertices.empty();
}

void update_holds(Environment& environment, double time) {
  State& state = environment.state;
  state.held.resize(environment.holds.size());
  for (std::size_t k = 0; k < environment.holds.size(); ++k) {
    const Hold& hold = environment.holds[k];
    const double middle = 0.5 * (state.time + time);
    const bool closed = hold.from <= middle && middle < hold.to;
    if (!closed)
      state.held[k] = {};
    else if (state.held[k].vertices.empty())
      state.held[k] = take(hold, state, frame_pose(environment, hold.frame, state.time), time);
  }
}

bool motion_is_over(const Environment& environment) {
  const State& state = environment.state;
  const double time = state.time + rounding;
  for (std::size_t k = 0; k < environment.holds.size(); ++k) {
    const Hold& hold = environment.holds[k];
    if (hold.from > time || (hold.to > time && std::isfinite(hold.to))) return false;
    if (k < state.held.size() && state.held[k].arrival > time) return false;
  }
  if (!environment.schedule) return true;
  const Schedule& schedule = *environment.schedule;
  return std::all_of(schedule.frames.begin(), schedule.frames.end(), [&](const auto& poses) {
    return schedule.start + static_cast<double>(poses.size() - 1) * schedule.time_step <= time;
  });
}

}  // namespace flash::sim
