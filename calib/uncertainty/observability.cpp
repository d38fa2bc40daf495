#include "calib/uncertainty/observability.h"

#include <Eigen/Eigenvalues>
#include <cmath>
#include <cstdio>

namespace flash::calib {
namespace {

template <class Vector>
Vector with_largest_positive(const Vector& v) {
  Eigen::Index largest = 0;
  v.cwiseAbs().maxCoeff(&largest);
  return v[largest] < 0 ? Vector(-v) : v;
}

}  // namespace

Eigen::Vector3d upright(const Eigen::Vector3d& v) { return with_largest_positive(v); }

std::string text_of(const Eigen::Vector3d& v) {
  char text[64];
  const Eigen::Vector3d r = (100 * v).array().round() / 100 + 0.0;  // no minus zero
  std::snprintf(text, sizeof text, "(%.2f, %.2f, %.2f)", r.x(), r.y(), r.z());
  return text;
}

RotationDiversity rotation_diversity(const std::vector<Eigen::Isometry3d>& poses) {
  RotationDiversity diversity;
  if (poses.size() < 2) return diversity;
  Eigen::Matrix3d moment = Eigen::Matrix3d::Zero();
  double count = 0;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    for (std::size_t j = i + 1; j < poses.size(); ++j, ++count) {
      const Eigen::Vector3d turn = rotation_log(poses[j].linear().transpose() * poses[i].linear());
      moment += turn * turn.transpose();
    }
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(moment / count);
  diversity.spread = eigen.eigenvalues().reverse().cwiseMax(0).cwiseSqrt();
  diversity.axes = eigen.eigenvectors().rowwise().reverse();
  diversity.first_share =
      diversity.spread[0] * diversity.spread[0] / std::max(diversity.spread.squaredNorm(), 1e-300);
  return diversity;
}

std::string degeneracy(const RotationDiversity& diversity, double least) {
  char text[320];
  // Turns that are small about all axes are not told apart by their shares.
  constexpr double kMostly = 0.9;
  if (diversity.spread[0] < least || (diversity.spread[1] < least && diversity.first_share < kMostly)) {
    std::snprintf(text, sizeof text,
                  "the gripper turns by no more than %.2f deg: neither rotation nor translation can be "
                  "determined; add views that tilt by 20 to 40 deg about two axes",
                  diversity.spread[0] * 180 / M_PI);
    return text;
  }
  return {};
}

WeakestDirection weakest_direction(const Matrix6d& covariance, double length, const std::string& frame) {
  Vector6d scale = Vector6d::Ones();
  scale.head<3>().setConstant(1 / length);
  const Eigen::SelfAdjointEigenSolver<Matrix6d> eigen(scale.asDiagonal() * covariance * scale.asDiagonal());
  const Vector6d values = eigen.eigenvalues().cwiseMax(0);
  WeakestDirection weakest;
  weakest.direction = with_largest_positive(Vector6d(eigen.eigenvectors().col(5)));
  const Eigen::Vector3d shift = weakest.direction.head<3>(), turn = weakest.direction.tail<3>();
  weakest.translation = std::sqrt(values[5]) * length * shift.norm();
  weakest.rotation = std::sqrt(values[5]) * turn.norm();
  weakest.condition = std::sqrt(values[5] / std::max(values[0], 1e-300));
  weakest.name = shift.norm() > turn.norm() ? "translation along " + text_of(upright(shift.normalized()))
                                            : "rotation about " + text_of(upright(turn.normalized()));
  weakest.name += " of the " + frame;
  return weakest;
}

}  // namespace flash::calib
