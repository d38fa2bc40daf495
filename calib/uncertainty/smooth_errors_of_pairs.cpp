#include "calib/uncertainty/smooth_errors_of_pairs.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace flash::calib {
namespace {

/// How a pair closes by an error of its robot pose, (dt, dtheta) in base axes at the gripper.
Matrix6d by_error(Setup setup, const Eigen::Isometry3d& T_base_gripper, const LinearLoop& linear,
                  const HandEyePoses& poses) {
  Matrix6d in_gripper = Matrix6d::Zero();  // T moved(I, in_gripper e)
  in_gripper.topLeftCorner<3, 3>() = in_gripper.bottomRightCorner<3, 3>() =
      T_base_gripper.linear().transpose();
  // predicted = X^-1 T^-1 Z of a camera in the hand, X^-1 T Z of one beside the robot
  if (setup == Setup::eye_in_hand)
    return -linear.by_predicted * adjoint(poses.Z.inverse() * T_base_gripper) * in_gripper;
  return linear.by_predicted * adjoint(poses.Z.inverse()) * in_gripper;
}

/// Columns of unit scatter of a pair's (dt, dtheta): along the line of sight as much more as was estimated.
Matrix6d scatter_columns(const LinearLoop& linear, const PoseSpaceFit& fit) {
  Matrix6d columns = Matrix6d::Identity();
  const double more = fit.translation.along / fit.translation.across - 1;
  columns.topLeftCorner<3, 3>() += more * linear.sight * linear.sight.transpose();
  return columns;
}

}  // namespace

SmoothErrorsOfPairs smooth_errors_of_pairs(Setup setup, const std::vector<Eigen::Isometry3d>& T_base_gripper,
                                           const std::vector<PoseLoop>& loops, const PoseSpaceFit& fit,
                                           const ScatterOfPairs& scatter,
                                           const std::optional<AlongPrior>& along) {
  const Eigen::Index poses = 12;
  std::vector<Eigen::Index> solved;  // scales
  for (const Eigen::Index i : {0, 1})
    if (scatter.scales(i, i) > 0) solved.push_back(i);
  const Eigen::Index s = poses + static_cast<Eigen::Index>(solved.size());
  // Of the variance of a pair's scatter: the rest is estimated beside each field.
  constexpr double kKnown = 0.01;
  const Eigen::Vector2d noise(std::pow(fit.translation.across, 2), std::pow(fit.rotation, 2));
  Vector6d variances;
  variances << Eigen::Vector3d::Constant(noise[0]), Eigen::Vector3d::Constant(noise[1]);
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const Eigen::Isometry3d& T : T_base_gripper)
    middle += T.translation() / static_cast<double>(T_base_gripper.size());
  Eigen::MatrixXd prior = Eigen::MatrixXd::Zero(s + 1, s + 1);
  for (std::size_t i = 0; i < solved.size(); ++i) {
    const Eigen::Index at = poses + static_cast<Eigen::Index>(i);
    prior(at, at) = scatter.known[solved[i]];
  }
  if (along) {
    const AlongResidual known = along_residual(*along, along->target ? fit.poses.Z : fit.poses.X);
    const Eigen::Index at = along->target ? 6 : 0;
    prior.block<6, 6>(at, at) += known.by_pose.transpose() * known.by_pose;
    prior.block<6, 1>(at, s) += known.by_pose.transpose() * known.value;
  }
  std::vector<PoseModes> modes;
  std::vector<PoseInformation> seen;
  Eigen::MatrixXd information = prior.topLeftCorner(s, s),
                  gains(s, 6 * static_cast<Eigen::Index>(loops.size()));
  for (std::size_t i = 0; i < loops.size(); ++i) {
    const LinearLoop linear = linear_loop(loops[i], fit.poses);
    Eigen::MatrixXd by_shared(6, s);
    by_shared.leftCols(poses) = linear.by_poses;
    by_shared.rightCols(s - poses) = linear.by_scales(Eigen::all, solved);
    const Matrix6d J = by_error(setup, T_base_gripper[i], linear, fit.poses),
                   columns = scatter_columns(linear, fit);
    const Matrix6d W = (columns * variances.asDiagonal() * columns.transpose()).inverse(), known = W / kKnown;
    information += by_shared.transpose() * W * by_shared;
    gains.middleCols<6>(6 * static_cast<Eigen::Index>(i)) = by_shared.transpose() * W * J;
    seen.push_back({.H = J.transpose() * known * J,
                    .H_s = J.transpose() * known * by_shared,
                    .H_ss = by_shared.transpose() * known * by_shared,
                    .g = J.transpose() * known * linear.residual,
                    .g_s = by_shared.transpose() * known * linear.residual});
    PoseModes& mode = modes.emplace_back(modes_at(T_base_gripper[i], Eigen::Vector3d::Zero(), middle));
    const Matrix6d as_errors = J.partialPivLu().solve(columns);  // which make this scatter
    mode.translation = as_errors.leftCols<3>();
    mode.rotation = as_errors.rightCols<3>();
  }
  const ArmErrorFit arm = fit_arm_errors(modes, seen, prior, noise);
  // In place of the independent scatter stands, by its share, what was found, and what the prior of the size
  // leaves.
  const double rest = 1 - arm.errors.share;
  const Eigen::LDLT<Eigen::MatrixXd> solution(information);
  const Eigen::MatrixXd moved_by = solution.solve(gains);
  Eigen::MatrixXd instead = moved_by * arm.covariance * moved_by.transpose();
  instead += arm.errors.share * solution.solve(solution.solve(prior.topLeftCorner(s, s)).transpose());
  SmoothErrorsOfPairs result{arm.errors, rest * scatter.covariance + instead.topLeftCorner<6, 6>(),
                             rest * scatter.scales};
  result.scales(solved, solved) += instead.bottomRightCorner(s - poses, s - poses);
  return result;
}

}  // namespace flash::calib
