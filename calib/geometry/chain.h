#pragma once
#include <Eigen/Geometry>

#include "calib/geometry/pose.h"
#include "calib/geometry/setup.h"

namespace flash::calib {

/// The closed chain from a point on the target to the camera,
///     q = C^-1 W^s Z p,   W = B A(tau) D,   A(tau) = moved(A, tau v)
/// with s = +1 for eye-to-hand (C = T_world_camera, Z = T_gripper_target) and s = -1 for eye-in-hand
/// (C = T_gripper_camera, Z = T_world_target). B = T_world_base tells several arms apart, D corrects the pose
/// that the robot reported, tau [s] is how much later than that pose its image was taken, v the
/// gripper's velocity.
class Chain {
 public:
  Chain(Setup setup, const Eigen::Isometry3d& C, const Eigen::Isometry3d& B, const Eigen::Isometry3d& A,
        const Eigen::Isometry3d& D, const Eigen::Isometry3d& Z, double tau = 0,
        const Vector6d& v = Vector6d::Zero());

  const Eigen::Isometry3d& target_in_camera() const { return T_camera_target_; }

  using Derivative = Eigen::Matrix<double, 3, 6>;
  /// Derivatives of q with respect to right perturbations of each link; p in the target, q in the camera
  /// frame.
  Derivative d_camera(const Eigen::Vector3d& q) const;
  Derivative d_target(const Eigen::Vector3d& p) const;
  Derivative d_correction(const Eigen::Vector3d& p) const;
  Derivative d_base(const Derivative& d_correction) const { return d_correction * base_to_gripper_; }
  Eigen::Vector3d d_time(const Derivative& d_correction) const { return d_correction * velocity_; }
  Eigen::Vector3d d_scale(const Eigen::Vector3d& p) const { return T_camera_target_.linear() * p; }

 private:
  Setup setup_;
  Eigen::Isometry3d T_camera_target_, T_gripper_target_;
  Eigen::Matrix3d R_camera_gripper_;
  Matrix6d base_to_gripper_;
  Vector6d velocity_;
};

/// A point measured on the target's plane, P in the camera frame, against that plane: the error of its depth
/// along the ray [m]. A motion of the chain moves the plane under P as if it carried P away, so the
/// derivative is that of the point of the target that now lies at P, with the opposite sign.
struct DepthResidual {
  double value = 0;               ///< measured minus predicted [m]
  Eigen::Vector3d material;       ///< P in the target frame [m]
  Eigen::RowVector3d d_material;  ///< -d(value) / d(q) of that point
};
DepthResidual depth_residual(const Chain& chain, const Eigen::Vector3d& P);

}  // namespace flash::calib
