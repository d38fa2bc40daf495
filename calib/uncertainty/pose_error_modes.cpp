#include "calib/uncertainty/pose_error_modes.h"

#include <cmath>

#include "calib/geometry/pose.h"

namespace flash::calib {
namespace {

/// Where the arm stands is not asked: poses may be in the frame of a table. It is taken to be kReach away, in
/// any direction from the middle of the places. What a turn about it does there is a shift of two axes in
/// three. Lengths are wrong by as much as a turn makes them over half of the reach: in base axes, at the
/// wrist, and of a stretch along the arm, one axis in three.
constexpr double kReach = 0.6;  // [m]

}  // namespace

PoseModes modes_at(const Eigen::Isometry3d& T_base_gripper, const Eigen::Vector3d& pivot,
                   const Eigen::Vector3d& middle) {
  PoseModes modes;
  modes.place = T_base_gripper.translation();
  modes.attitude = T_base_gripper.linear();
  const Eigen::Vector3d at = modes.attitude * pivot;
  const Eigen::Matrix3d I = Eigen::Matrix3d::Identity(), O = Eigen::Matrix3d::Zero();
  modes.translation << I, O;
  modes.rotation << skew(at) * modes.attitude, modes.attitude;
  auto& [wrist, base, shift, shift_of_wrist, stretch] = modes.smooth;
  wrist = modes.rotation;
  const Eigen::Vector3d place = modes.place - middle;
  const double shifted = kReach * std::sqrt(2.0 / 3 + 0.25 + 0.25 / 3);
  base << -skew(place), I;
  shift << shifted * I, O;
  shift_of_wrist << 0.5 * kReach * modes.attitude, O;
  stretch.setZero();
  stretch.col(0).head<3>() = 0.5 * place;
  return modes;
}

std::vector<PoseModes> modes_of(const Bundle& bundle, const std::vector<std::size_t>& poses) {
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const std::size_t i : poses)
    middle += bundle.poses[i].T_base_gripper.translation() / static_cast<double>(poses.size());
  std::vector<PoseModes> modes;
  for (const std::size_t i : poses) {
    const RobotPose& pose = bundle.poses[i];
    modes.push_back(modes_at(pose.T_base_gripper, bundle.pivots[static_cast<std::size_t>(pose.arm)], middle));
  }
  return modes;
}

Eigen::MatrixXd squared_distances(const std::vector<PoseModes>& modes) {
  const auto count = static_cast<Eigen::Index>(modes.size());
  Eigen::MatrixXd squared(count, count);
  for (Eigen::Index i = 0; i < count; ++i)
    for (Eigen::Index j = 0; j < count; ++j) {
      const PoseModes &a = modes[static_cast<std::size_t>(i)], &b = modes[static_cast<std::size_t>(j)];
      squared(i, j) = (a.place - b.place).squaredNorm() / (kReach * kReach) +
                      0.5 * (a.attitude - b.attitude).squaredNorm();
    }
  return squared;
}

Eigen::MatrixXd matern(const Eigen::MatrixXd& squared, double reach) {
  return squared.unaryExpr([reach](double d2) {
    const double x = std::sqrt(5 * d2) / reach;
    return (1 + x + x * x / 3) * std::exp(-x);
  });
}

}  // namespace flash::calib
