#include "calib/geometry/chain.h"

namespace flash::calib {

Chain::Chain(Setup setup, const Eigen::Isometry3d& C, const Eigen::Isometry3d& B, const Eigen::Isometry3d& A,
             const Eigen::Isometry3d& D, const Eigen::Isometry3d& Z, double tau, const Vector6d& v)
    : setup_(setup) {
  const Eigen::Isometry3d W = B * moved(A, tau * v) * D;
  if (setup == Setup::eye_to_hand) {
    T_gripper_target_ = Z;
    R_camera_gripper_ = C.linear().transpose() * W.linear();
    T_camera_target_ = C.inverse() * W * Z;
  } else {
    T_gripper_target_ = W.inverse() * Z;
    R_camera_gripper_ = C.linear().transpose();
    T_camera_target_ = C.inverse() * T_gripper_target_;
  }
  base_to_gripper_ = adjoint(W.inverse() * B);
  Vector6d local = v;
  local.head<3>() = rotation_exp(-tau * v.tail<3>()) * v.head<3>();
  velocity_ = adjoint(D.inverse()) * local;
}

Chain::Derivative Chain::d_camera(const Eigen::Vector3d& q) const {
  Derivative d;
  d << -Eigen::Matrix3d::Identity(), skew(q);
  return d;
}

Chain::Derivative Chain::d_target(const Eigen::Vector3d& p) const {
  Derivative d;
  d << T_camera_target_.linear(), -T_camera_target_.linear() * skew(p);
  return d;
}

Chain::Derivative Chain::d_correction(const Eigen::Vector3d& p) const {
  const Eigen::Vector3d g = T_gripper_target_ * p;
  const double sign = setup_ == Setup::eye_to_hand ? 1 : -1;
  Derivative d;
  d << sign * R_camera_gripper_, -sign * R_camera_gripper_ * skew(g);
  return d;
}

DepthResidual depth_residual(const Chain& chain, const Eigen::Vector3d& P) {
  DepthResidual residual;
  residual.material = chain.target_in_camera().inverse() * P;
  const Eigen::Vector3d normal = chain.target_in_camera().linear().col(2);
  const double along_ray = normal.dot(P / P.z());
  residual.value = residual.material.z() / along_ray;
  residual.d_material = normal.transpose() / along_ray;
  return residual;
}

}  // namespace flash::calib
