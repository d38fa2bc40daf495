#pragma once
#include <Eigen/Geometry>
#include <string>
#include <vector>

namespace flash::data {

/// Poses over time, T_parent_child: translation [m], rotation; times [s] strictly increasing.
struct Trajectory {
  std::vector<double> times;
  std::vector<Eigen::Isometry3d> poses;
};

/// The pose that has gone `share` of the way: linear in translation, slerp in rotation.
Eigen::Isometry3d pose_between(const Eigen::Isometry3d& before, const Eigen::Isometry3d& after, double share);

/// Pose at time t [s]: linear in translation, slerp in rotation, held constant outside the recorded span.
Eigen::Isometry3d pose_at(const Trajectory& trajectory, double t);

/// TUM lines `t tx ty tz qx qy qz qw`, `#` comments; t in seconds or nanoseconds. A comment before the first
/// line that names the columns in another order, as qw qx qy qz, is followed. Throws InputError naming the
/// line unless times increase strictly and quaternions are unit to 1e-3.
Trajectory load_tum(const std::string& path);
void save_tum(const Trajectory& trajectory, const std::string& path);

/// CSV whose header names t,tx,ty,tz,qx,qy,qz,qw in any order, or as load_pose_table knows them; separator
/// comma or semicolon. Errors as load_tum.
Trajectory load_trajectory_csv(const std::string& path);

/// Any list of poses that load_pose_list reads and whose poses have times: TUM, CSV, JSON, or bare matrices
/// and quaternions behind a time. Throws InputError where they have none, and as load_tum.
Trajectory load_trajectory(const std::string& path);

/// Pose as translation and x y z w quaternion, the order of files.
Eigen::Matrix<double, 7, 1> to_vector(const Eigen::Isometry3d& pose);

/// Inverse of to_vector; the quaternion is normalised.
Eigen::Isometry3d from_vector(const Eigen::Matrix<double, 7, 1>& pose);

}  // namespace flash::data
