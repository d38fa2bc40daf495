#include "sim/cuda/flat_motions.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <stdexcept>

#include "sim/step/moving_obstacles.h"

namespace flash::sim::cuda {
namespace {

/// Poses of a schedule's frames at the start of a replay and after each step.
std::vector<FramePose> frame_poses(const ReplayEnvironment& environment, double time_step, int steps,
                                   int frames) {
  std::vector<FramePose> poses;
  for (int k = 0; k <= steps; ++k)
    for (int f = 0; f < frames; ++f) {
      FramePose pose{frame_of(Eigen::Isometry3d::Identity()), {}};
      if (environment.schedule != nullptr && f < std::ssize(environment.schedule->frames)) {
        const Eigen::Isometry3d from = pose_at(*environment.schedule, f, environment.time + k * time_step),
                                to =
                                    pose_at(*environment.schedule, f, environment.time + (k + 1) * time_step);
        const Eigen::AngleAxisd turn(to.linear() * from.linear().transpose());
        pose = {frame_of(from), vector3(Eigen::Vector3d(turn.angle() * turn.axis()))};
      }
      poses.push_back(pose);
    }
  return poses;
}

}  // namespace

int FlatMotions::add(const ReplayEnvironment& environment, double time_step, int steps,
                     const std::vector<int>& position) {
  const HoldMotion* motion = environment.holds.get();
  const auto [found, is_new] =
      motions_.emplace(Key{motion, environment.springs.get(), environment.schedule.get(), environment.time},
                       static_cast<int>(motions_.size()));
  if (!is_new) return found->second;
  const std::vector<FramePose> own = frame_poses(environment, time_step, steps, frames);
  poses.insert(poses.end(), own.begin(), own.end());
  std::vector<int> held_in(position.size(), -1);
  for (int k = 0; k < steps; ++k) {
    starts.push_back(static_cast<int>(holds.size()));
    if (motion == nullptr) continue;
    for (const HeldVertex& held : (*motion)[k]) {
      if (held.vertex < 0 || held.vertex >= std::ssize(position) || held_in[held.vertex] == k)
        throw std::invalid_argument("replay: a vertex that is not there or is held twice");
      held_in[held.vertex] = k;
      holds.push_back({position[held.vertex],
                       int{held.axes[0]} | 2 * int{held.axes[1]} | 4 * int{held.axes[2]},
                       {held.target.x(), held.target.y(), held.target.z()},
                       {held.holds[0], held.holds[1], held.holds[2]}});
    }
    most = std::max(most, static_cast<int>(holds.size()) - starts.back());
  }
  starts.push_back(static_cast<int>(holds.size()));
  for (int k = 0; k < steps; ++k) {
    spring_starts.push_back(static_cast<int>(springs.size()));
    if (environment.springs == nullptr) continue;
    for (const SpringMotion& spring : (*environment.springs)[k])
      springs.push_back({position[spring.vertex],
                         int{spring.axes[0]} | 2 * int{spring.axes[1]} | 4 * int{spring.axes[2]},
                         spring.hold,
                         spring.entry,
                         {spring.from.x(), spring.from.y(), spring.from.z()},
                         {spring.to.x(), spring.to.y(), spring.to.z()}});
    std::stable_sort(springs.begin() + spring_starts.back(), springs.end(),
                     [](const SpringPlace& a, const SpringPlace& b) { return a.place < b.place; });
  }
  spring_starts.push_back(static_cast<int>(springs.size()));
  return found->second;
}

}  // namespace flash::sim::cuda
