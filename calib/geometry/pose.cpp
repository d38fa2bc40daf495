#include "calib/geometry/pose.h"

#include <Eigen/SVD>
#include <cmath>

namespace flash::calib {

Eigen::Matrix3d skew(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

Eigen::Matrix3d rotation_exp(const Eigen::Vector3d& v) {
  const double angle = v.norm();
  if (angle < 1e-12) return Eigen::Matrix3d::Identity() + skew(v);
  return Eigen::AngleAxisd(angle, v / angle).toRotationMatrix();
}

Eigen::Vector3d rotation_log(const Eigen::Matrix3d& R) {
  // By way of the quaternion: well conditioned up to pi, unlike the skew part of R.
  Eigen::Quaterniond q(R);
  if (q.w() < 0) q.coeffs() = -q.coeffs();
  const double sine = q.vec().norm();
  if (sine < 1e-12) return 2 * q.vec();
  return 2 * std::atan2(sine, q.w()) / sine * q.vec();
}

Eigen::Vector3d roll_pitch_yaw(const Eigen::Matrix3d& R) {
  const double pitch = std::atan2(-R(2, 0), std::hypot(R(0, 0), R(1, 0)));
  // At a pitch of 90 deg only the sum or difference of the others counts: all of it becomes yaw.
  if (std::hypot(R(0, 0), R(1, 0)) < 1e-9) return {0, pitch, std::atan2(-R(0, 1), R(1, 1))};
  return {std::atan2(R(2, 1), R(2, 2)), pitch, std::atan2(R(1, 0), R(0, 0))};
}

Eigen::Matrix3d rotation_of_rpy(const Eigen::Vector3d& rpy) {
  return (Eigen::AngleAxisd(rpy.z(), Eigen::Vector3d::UnitZ()) *
          Eigen::AngleAxisd(rpy.y(), Eigen::Vector3d::UnitY()) *
          Eigen::AngleAxisd(rpy.x(), Eigen::Vector3d::UnitX()))
      .toRotationMatrix();
}

double rotation_angle(const Eigen::Matrix3d& R) { return rotation_log(R).norm(); }

Eigen::Isometry3d moved(const Eigen::Isometry3d& T, const Vector6d& xi) {
  Eigen::Isometry3d result = Eigen::Isometry3d::Identity();
  result.linear() = T.linear() * rotation_exp(xi.tail<3>());
  result.translation() = T.translation() + T.linear() * xi.head<3>();
  return result;
}

Vector6d motion_between(const Eigen::Isometry3d& from, const Eigen::Isometry3d& to) {
  Vector6d xi;
  xi << from.linear().transpose() * (to.translation() - from.translation()),
      rotation_log(from.linear().transpose() * to.linear());
  return xi;
}

Matrix6d adjoint(const Eigen::Isometry3d& T) {
  Matrix6d m;
  m << T.linear(), skew(T.translation()) * T.linear(), Eigen::Matrix3d::Zero(), T.linear();
  return m;
}

Eigen::Matrix3d right_jacobian_inverse(const Eigen::Vector3d& v) {
  const double angle = v.norm();
  const Eigen::Matrix3d V = skew(v);
  // 1 / angle^2 - (1 + cos) / (2 angle sin) -> 1 / 12
  const double c =
      angle < 1e-4 ? 1.0 / 12 : (1 - 0.5 * angle * std::sin(angle) / (1 - std::cos(angle))) / (angle * angle);
  return Eigen::Matrix3d::Identity() + 0.5 * V + c * V * V;
}

Eigen::Matrix3d nearest_rotation(const Eigen::Matrix3d& M) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(M, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Vector3d signs(1, 1, (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1);
  return svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
}

Eigen::Isometry3d mean_pose(const std::vector<Eigen::Isometry3d>& poses) {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Zero();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();
  for (const Eigen::Isometry3d& pose : poses) {
    rotation += pose.linear();
    translation += pose.translation() / static_cast<double>(poses.size());
  }
  Eigen::Isometry3d mean = Eigen::Isometry3d::Identity();
  mean.linear() = nearest_rotation(rotation);
  mean.translation() = translation;
  return mean;
}

}  // namespace flash::calib
