#pragma once
#include <Eigen/Geometry>
#include <memory>
#include <span>
#include <vector>

#include "data/motion/trajectory.h"

namespace flash::sim {

/// The one timeline of a simulation: poses T_base_frame of grippers, moving supports and moving obstacles, at
/// even steps of time. A trajectory is sampled once; environments that see the same motion share the
/// schedule.
struct Schedule {
  double start = 0.0;                                  ///< time of pose 0 of every frame [s]
  double time_step = 0.01;                             ///< between two poses [s]
  std::vector<std::vector<Eigen::Isometry3d>> frames;  ///< poses of each frame; the last one stays for good
  long first = 0;  ///< number of the first pose of every frame: those before it are not there any more
};

/// Samples `trajectories` at `start` and at the ends of the `steps` steps that follow, a frame each.
std::shared_ptr<const Schedule> make_schedule(std::span<const data::Trajectory> trajectories, double start,
                                              double time_step, int steps);

/// Pose of a frame at `time` [s]. Between two samples, where a part of a step may end, the translation is
/// linear and the rotation slerp. Throws std::out_of_range where the schedule has no such frame.
Eigen::Isometry3d pose_at(const Schedule& schedule, int frame, double time);

}  // namespace flash::sim
