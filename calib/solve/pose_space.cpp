#include "calib/solve/pose_space.h"

#include <algorithm>
#include <cmath>

#include "calib/geometry/pose.h"
#include "calib/solve/reml.h"

namespace flash::calib {
namespace {

constexpr int kPoses = 12;  // X, then Z

using Rows = Eigen::Matrix<double, 3, kPoses + 2>;

/// Rows of [d_X d_Z d_log_size residual]: rotation in the first block, translation in the second.
std::pair<Rows, Rows> rows_of(const PoseLoop& loop, const HandEyePoses& poses, double camera_share) {
  const Eigen::Isometry3d predicted = poses.X.inverse() * loop.G.inverse() * poses.Z;
  const Eigen::Isometry3d E = predicted.inverse() * loop.C;
  const Eigen::Vector3d angle = rotation_log(E.linear());
  Matrix6d d_Z;  // of (dt, dtheta): Exp(-z) E
  d_Z << -Eigen::Matrix3d::Identity(), skew(E.translation()), Eigen::Matrix3d::Zero(),
      -right_jacobian_inverse(angle) * E.linear().transpose();
  const Matrix6d d_X = -d_Z * adjoint(predicted.inverse());
  // A residual that is the camera's grows with the size: that over the size counts.
  const Eigen::Vector3d d_size =
      predicted.linear().transpose() * loop.C.translation() - camera_share * E.translation();
  Rows rotation, translation;
  translation << d_X.topRows<3>(), d_Z.topRows<3>(), d_size, E.translation();
  rotation << d_X.bottomRows<3>(), d_Z.bottomRows<3>(), Eigen::Vector3d::Zero(), angle;
  return {rotation, translation};
}

LinearModel linearize(const std::vector<PoseLoop>& loops, const PoseSpaceFit& fit,
                      const std::optional<SizeUnknown>& size) {
  const int shared = kPoses + (size ? 1 : 0);
  LinearModel model{.groups = 1, .components = 2, .own = 0, .shared = shared, .blocks = {}};
  // Few pairs hardly tell how noisy they are: what robots and trackers usually are, within a factor of three.
  constexpr std::size_t kFew = 8;
  if (loops.size() < kFew) model.noise = {{0.1 * M_PI / 180, 1e-3}, 1};
  Eigen::Matrix<double, kPoses + 2, kPoses + 2> rotations, translations;
  rotations.setZero();
  translations.setZero();
  for (const PoseLoop& loop : loops) {
    const auto [rotation, translation] = rows_of(loop, fit.poses, size ? size->camera_share : 0);
    rotations += rotation.transpose() * rotation;
    translations += translation.transpose() * translation;
  }
  std::vector<int> columns;
  for (int column = 0; column < kPoses + 2; ++column)
    if (size || column != kPoses) columns.push_back(column);
  const double count = 3 * static_cast<double>(loops.size());
  model.blocks = {{0, 0, count, rotations(columns, columns)}, {0, 1, count, translations(columns, columns)}};
  if (size && std::isfinite(size->prior_sd)) {
    Eigen::RowVectorXd row = Eigen::RowVectorXd::Zero(shared + 1);
    row[kPoses] = 1 / size->prior_sd;
    row[shared] = std::log(fit.size) / size->prior_sd;
    model.prior = row.transpose() * row;
  }
  return model;
}

}  // namespace

std::vector<PoseLoop> resized(std::vector<PoseLoop> loops, double size) {
  for (PoseLoop& loop : loops) loop.C.translation() *= size;
  return loops;
}

PoseSpaceFit fit_pose_space(const std::vector<PoseLoop>& loops, const HandEyePoses& seed,
                            const std::optional<SizeUnknown>& size) {
  PoseSpaceFit fit{.poses = seed, .covariance = {}};
  std::vector<double> sigmas = {1e-2, 1e-2};
  for (int iteration = 0; iteration < 50 && !fit.converged; ++iteration) {
    const LinearModel model = linearize(size ? resized(loops, fit.size) : loops, fit, size);
    const VarianceComponents estimate = estimate_variance_components(model, sigmas, {1e-7, 1e-7});
    sigmas = estimate.sigmas;
    const LinearSolution solution = solve_linear(model, sigmas);
    fit.poses.X = moved(fit.poses.X, solution.shared.head<6>());
    fit.poses.Z = moved(fit.poses.Z, solution.shared.segment<6>(6));
    if (size) fit.size *= std::exp(std::clamp(solution.shared[kPoses], -0.5, 0.5));
    fit.covariance = adjusted_covariance(model, estimate);
    fit.converged = solution.shared.norm() < 1e-9;
  }
  if (loops.size() > 3) fit.covariance *= tail_growth(3 * static_cast<double>(loops.size()) - 6);
  fit.rotation = sigmas[0];
  fit.translation = sigmas[1];
  return fit;
}

}  // namespace flash::calib
