#include "calib/solve/pose_space.h"

#include <cmath>

#include "calib/geometry/pose.h"
#include "calib/solve/reml.h"

namespace flash::calib {
namespace {

constexpr int kShared = 12;  // X, then Z

/// Rows of [d_X d_Z residual]: rotation in the first block, translation in the second.
std::pair<Eigen::Matrix<double, 3, kShared + 1>, Eigen::Matrix<double, 3, kShared + 1>> rows_of(
    const PoseLoop& loop, const HandEyePoses& poses) {
  const Eigen::Isometry3d predicted = poses.X.inverse() * loop.G.inverse() * poses.Z;
  const Eigen::Isometry3d E = predicted.inverse() * loop.C;
  const Eigen::Vector3d angle = rotation_log(E.linear());
  Matrix6d d_Z;  // of (dt, dtheta): Exp(-z) E
  d_Z << -Eigen::Matrix3d::Identity(), skew(E.translation()), Eigen::Matrix3d::Zero(),
      -right_jacobian_inverse(angle) * E.linear().transpose();
  const Matrix6d d_X = -d_Z * adjoint(predicted.inverse());
  Eigen::Matrix<double, 3, kShared + 1> rotation, translation;
  translation << d_X.topRows<3>(), d_Z.topRows<3>(), E.translation();
  rotation << d_X.bottomRows<3>(), d_Z.bottomRows<3>(), angle;
  return {rotation, translation};
}

LinearModel linearize(const std::vector<PoseLoop>& loops, const HandEyePoses& poses) {
  LinearModel model{.groups = 1, .components = 2, .own = 0, .shared = kShared, .blocks = {}};
  // Few pairs hardly tell how noisy they are: what robots and trackers usually are, within a factor of three.
  constexpr std::size_t kFew = 8;
  if (loops.size() < kFew) model.noise = {{0.1 * M_PI / 180, 1e-3}, 1};
  Eigen::Matrix<double, kShared + 1, kShared + 1> rotations, translations;
  rotations.setZero();
  translations.setZero();
  for (const PoseLoop& loop : loops) {
    const auto [rotation, translation] = rows_of(loop, poses);
    rotations += rotation.transpose() * rotation;
    translations += translation.transpose() * translation;
  }
  const double count = 3 * static_cast<double>(loops.size());
  model.blocks = {{0, 0, count, rotations}, {0, 1, count, translations}};
  return model;
}

}  // namespace

PoseSpaceFit fit_pose_space(const std::vector<PoseLoop>& loops, const HandEyePoses& seed) {
  PoseSpaceFit fit{.poses = seed, .covariance = {}};
  std::vector<double> sigmas = {1e-2, 1e-2};
  for (int iteration = 0; iteration < 50 && !fit.converged; ++iteration) {
    const LinearModel model = linearize(loops, fit.poses);
    const VarianceComponents estimate = estimate_variance_components(model, sigmas, {1e-7, 1e-7});
    sigmas = estimate.sigmas;
    const LinearSolution solution = solve_linear(model, sigmas);
    fit.poses.X = moved(fit.poses.X, solution.shared.head<6>());
    fit.poses.Z = moved(fit.poses.Z, solution.shared.tail<6>());
    fit.covariance = adjusted_covariance(model, estimate);
    fit.converged = solution.shared.norm() < 1e-9;
  }
  if (loops.size() > 3) fit.covariance *= tail_growth(3 * static_cast<double>(loops.size()) - 6);
  fit.rotation = sigmas[0];
  fit.translation = sigmas[1];
  return fit;
}

}  // namespace flash::calib
