#pragma once
#include <optional>
#include <string>
#include <vector>

#include "calib/dataset/observation.h"
#include "calib/dataset/symmetry.h"
#include "calib/geometry/pose.h"
#include "data/motion/trajectory.h"

namespace flash::calib {

/// Pictures stamped t were taken when the clock of the poses said t + estimate.
struct TimeOffset {
  double estimate = 0, sd = 0;  ///< [s]
};

/// The gripper at one time of a stream of poses.
struct Motion {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  Vector6d velocity = Vector6d::Zero();  ///< in the gripper's frame [m/s, rad/s]
};

/// Pose at time t, velocity as the mean over t +- half [s]. None where that reaches beyond the stream, or
/// where its poses are more than half a second apart.
std::optional<Motion> motion_at(const data::Trajectory& stream, double t, double half = 0.05);

/// The views with the gripper as the stream has it at their stamps + tau, velocities with it. Views whose
/// time lies beyond the stream lose their poses of the target, and are named in `beyond` by their place.
std::vector<Observation> placed(const data::Trajectory& stream, const std::vector<double>& stamps, double tau,
                                std::vector<Observation> views, std::vector<std::size_t>* beyond = nullptr);

/// Offset within +- 0.3 s, in steps of 0.02 s, at which most views agree best; 0 where none is clearly better
/// than none at all. An offset of more than some 50 ms would have the views taken for outliers.
double coarse_offset(Setup setup, const data::Trajectory& stream, const std::vector<double>& stamps,
                     const std::vector<Observation>& views, const std::vector<Symmetry>& symmetries);

/// Speed of the gripper, rms over the views, a radian at half a metre [m/s].
double rms_speed(const std::vector<Observation>& views);

}  // namespace flash::calib
