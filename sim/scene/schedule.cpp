#include "sim/scene/schedule.h"

#include <algorithm>
#include <cmath>

namespace flash::sim {

using Eigen::Isometry3d;

std::shared_ptr<const Schedule> make_schedule(std::span<const data::Trajectory> trajectories, double start,
                                              double time_step, int steps) {
  Schedule schedule{.start = start, .time_step = time_step, .frames = {}};
  for (const data::Trajectory& trajectory : trajectories) {
    std::vector<Isometry3d>& poses = schedule.frames.emplace_back();
    // The last pose stays for good: a long rest takes no memory.
    const double end = trajectory.times.empty() ? start : trajectory.times.back();
    const double last = std::clamp(std::ceil((end - start) / time_step), 0.0, static_cast<double>(steps));
    for (int k = 0; k <= static_cast<int>(last); ++k)
      poses.push_back(data::pose_at(trajectory, start + k * time_step));
    while (poses.size() > 1 && poses.back().matrix() == poses[poses.size() - 2].matrix()) poses.pop_back();
    poses.shrink_to_fit();
  }
  return std::make_shared<const Schedule>(std::move(schedule));
}

Isometry3d pose_at(const Schedule& schedule, int frame, double time) {
  constexpr double rounding = 1e-6;  // of a time that is a sum of steps, in steps
  const std::vector<Isometry3d>& poses = schedule.frames.at(static_cast<std::size_t>(frame));
  const double first = static_cast<double>(schedule.first),
               last = first + static_cast<double>(poses.size() - 1);
  const double step = std::clamp((time - schedule.start) / schedule.time_step, first, last);
  const double before = std::floor(step + rounding);
  const auto index = static_cast<std::size_t>(before - first);
  const double share = step - before;
  if (share <= rounding) return poses[index];
  if (share >= 1 - rounding) return poses[index + 1];
  return data::pose_between(poses[index], poses[index + 1], share);
}

}  // namespace flash::sim
