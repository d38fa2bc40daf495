#pragma once
#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "calib/geometry/pose.h"

namespace flash::calib {

/// How the gripper turned between the views: what a hand-eye calibration lives on.
struct RotationDiversity {
  Eigen::Vector3d spread =
      Eigen::Vector3d::Zero();  ///< rms turn about the principal axes, largest first [rad]
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();  ///< those axes in the gripper frame, columns
  double first_share = 0;  ///< of the first axis in the sum of squares; 1: all turns are about it
};
RotationDiversity rotation_diversity(const std::vector<Eigen::Isometry3d>& T_base_gripper);

/// No turns at all: one sentence that says what cannot be determined; else empty. least: rms turn that counts
/// [rad].
std::string degeneracy(const RotationDiversity& diversity, double least = 0.017);

/// The sign that makes the largest part of a direction positive.
Eigen::Vector3d upright(const Eigen::Vector3d& v);

/// "(0.02, 0.01, 1.00)"
std::string text_of(const Eigen::Vector3d& v);

/// The direction of a pose that a calibration knows least.
struct WeakestDirection {
  Vector6d direction = Vector6d::Zero();  ///< unit in (dt / length, dtheta), largest part positive
  double translation = 0;                 ///< standard deviation along it, translation part [m]
  double rotation = 0;                    ///< rotation part [rad]
  double condition = 1;                   ///< largest over smallest standard deviation of the scaled pose
  std::string name;                       ///< "translation along (0.02, 0.01, 1.00) of the camera"
};

/// length: what a radian is worth, the usual distance from camera to target [m].
WeakestDirection weakest_direction(const Matrix6d& covariance, double length, const std::string& frame);

}  // namespace flash::calib
