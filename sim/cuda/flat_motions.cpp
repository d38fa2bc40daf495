#include "sim/cuda/flat_motions.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <stdexcept>

#include "sim/step/moving_obstacles.h"

namespace flash::sim::cuda {

/// Poses of the frames at the start of the steps and after each of them.
void FlatMotions::add_poses(const Motion& motion, double time_step, int steps) {
  for (int k = 0; k <= steps; ++k)
    for (int f = 0; f < frames; ++f) {
      FramePose pose{frame_of(Eigen::Isometry3d::Identity()), {}};
      if (motion.schedule != nullptr && f < std::ssize(motion.schedule->frames)) {
        const Eigen::Isometry3d from = pose_at(*motion.schedule, f, motion.time + k * time_step),
                                to = pose_at(*motion.schedule, f, motion.time + (k + 1) * time_step);
        const Eigen::AngleAxisd turn(to.linear() * from.linear().transpose());
        pose = {frame_of(from), vector3(Eigen::Vector3d(turn.angle() * turn.axis()))};
      }
      poses.push_back(pose);
    }
}

int FlatMotions::add(const Motion& motion, double time_step, int steps, const std::vector<int>& position) {
  const auto [found, is_new] = motions_.emplace(motion, count());
  if (!is_new) return found->second;
  add_poses(motion, time_step, steps);
  held_in_.resize(position.size(), -1);
  for (int k = 0; k < steps; ++k, ++steps_added_) {
    starts.push_back(static_cast<int>(holds.size()));
    if (motion.holds == nullptr || k >= std::ssize(*motion.holds)) continue;
    for (const HeldVertex& held : (*motion.holds)[static_cast<std::size_t>(k)]) {
      if (held.vertex < 0 || held.vertex >= std::ssize(position) || held_in_[held.vertex] == steps_added_)
        throw std::invalid_argument("replay: a vertex that is not there or is held twice");
      held_in_[held.vertex] = steps_added_;
      holds.push_back({position[held.vertex],
                       int{held.axes[0]} | 2 * int{held.axes[1]} | 4 * int{held.axes[2]},
                       {held.target.x(), held.target.y(), held.target.z()},
                       {held.holds[0], held.holds[1], held.holds[2]},
                       {held.bow.x(), held.bow.y(), held.bow.z()}});
    }
    most = std::max(most, static_cast<int>(holds.size()) - starts.back());
  }
  starts.push_back(static_cast<int>(holds.size()));
  for (int k = 0; k < steps; ++k) {
    spring_starts.push_back(static_cast<int>(springs.size()));
    if (motion.springs == nullptr || k >= std::ssize(*motion.springs)) continue;
    for (const SpringMotion& spring : (*motion.springs)[static_cast<std::size_t>(k)])
      springs.push_back({position[spring.vertex],
                         int{spring.axes[0]} | 2 * int{spring.axes[1]} | 4 * int{spring.axes[2]},
                         spring.hold,
                         spring.entry,
                         {spring.from.x(), spring.from.y(), spring.from.z()},
                         {spring.to.x(), spring.to.y(), spring.to.z()},
                         {spring.bow.x(), spring.bow.y(), spring.bow.z()}});
    std::stable_sort(springs.begin() + spring_starts.back(), springs.end(),
                     [](const SpringPlace& a, const SpringPlace& b) { return a.place < b.place; });
  }
  spring_starts.push_back(static_cast<int>(springs.size()));
  return found->second;
}

}  // namespace flash::sim::cuda
