#include "calib/solve/pose_space.h"

#include <algorithm>
#include <cmath>

#include "calib/geometry/pose.h"
#include "calib/solve/reml.h"

namespace flash::calib {
namespace {

constexpr int kPoses = 12;  // X, then Z

using Rows = Eigen::Matrix<double, 3, kPoses + 2>;
using Gram = Eigen::Matrix<double, kPoses + 2, kPoses + 2>;

/// Components of variance.
enum Component : int { kRotation, kAcross, kAlong, kComponents };

/// How much of the noise is the camera's.
struct CameraShare {
  double across = 0, along = 0;
};

/// Whatever the noise along the line of sight exceeds that across it by is the camera's.
CameraShare camera_share(const SizeUnknown& size, const std::vector<double>& sigmas) {
  const double even = std::min(1.0, std::pow(sigmas[kAcross] / sigmas[kAlong], 2));
  return {size.camera_share, 1 - (1 - size.camera_share) * even};
}

/// Of the target as seen, in the frame of the target as predicted; zero where it has none.
Eigen::Vector3d line_of_sight(const PoseLoop& loop, const Eigen::Isometry3d& predicted) {
  constexpr double kNearest = 1e-6;  // [m]
  const double distance = loop.C.translation().norm();
  if (!(distance > kNearest)) return Eigen::Vector3d::Zero();
  return predicted.linear().transpose() * loop.C.translation() / distance;
}

/// Rows of [d_X d_Z d_log_size residual]: rotation, then translation; and the line of sight.
struct LoopRows {
  Rows rotation, translation;
  Eigen::Vector3d sight;
};

LoopRows rows_of(const PoseLoop& loop, const HandEyePoses& poses, const CameraShare& share) {
  const LinearLoop linear = linear_loop(loop, poses);
  LoopRows rows;
  rows.sight = linear.sight;
  const Eigen::Vector3d dt = linear.residual.head<3>();
  // A residual that is the camera's grows with the size: that over the size counts.
  const Eigen::Vector3d along = rows.sight * rows.sight.dot(dt);
  const Eigen::Vector3d d_size = linear.by_size.head<3>() - share.across * (dt - along) - share.along * along;
  rows.translation << linear.by_poses.topRows<3>(), d_size, dt;
  rows.rotation << linear.by_poses.bottomRows<3>(), Eigen::Vector3d::Zero(), linear.residual.tail<3>();
  return rows;
}

/// What is known of the noise of so many pairs.
NoisePrior noise_prior(std::size_t pairs) {
  // Where a camera sees the target, several times as much along the line of sight as across it. A tracker or
  // an arm that is worse than the camera has as much along as across: a few pairs more tell.
  NoisePrior prior{.ratios = {{kAlong, kAcross, 2, 1}}};
  // Few pairs hardly tell how noisy they are: what robots and trackers usually are, within a factor of three.
  constexpr std::size_t kFew = 8;
  if (pairs >= kFew) return prior;
  prior.usual = {0.1 * M_PI / 180, 1e-3, 1e-3};
  prior.spread = 1;
  return prior;
}

LinearModel linearize(const std::vector<PoseLoop>& loops, const PoseSpaceFit& fit,
                      const std::vector<double>& sigmas, const std::optional<SizeUnknown>& size,
                      const std::optional<AlongPrior>& known) {
  const int shared = kPoses + (size ? 1 : 0);
  LinearModel model{.groups = 1, .components = kComponents, .own = 0, .shared = shared, .blocks = {}};
  model.noise = noise_prior(loops.size());
  const CameraShare share = size ? camera_share(*size, sigmas) : CameraShare{};
  Gram grams[kComponents] = {Gram::Zero(), Gram::Zero(), Gram::Zero()};
  double counts[kComponents] = {};
  for (const PoseLoop& loop : loops) {
    const LoopRows rows = rows_of(loop, fit.poses, share);
    const Eigen::Matrix<double, 1, kPoses + 2> along = rows.sight.transpose() * rows.translation;
    grams[kRotation] += rows.rotation.transpose() * rows.rotation;
    grams[kAlong] += along.transpose() * along;
    grams[kAcross] += rows.translation.transpose() * rows.translation - along.transpose() * along;
    const double lines = rows.sight.squaredNorm() > 0.5 ? 1 : 0;
    counts[kRotation] += 3;
    counts[kAcross] += 3 - lines;
    counts[kAlong] += lines;
  }
  std::vector<int> columns;
  for (int column = 0; column < kPoses + 2; ++column)
    if (size || column != kPoses) columns.push_back(column);
  for (int i = 0; i < kComponents; ++i) model.blocks.push_back({0, i, counts[i], grams[i](columns, columns)});
  if (size && std::isfinite(size->prior_sd)) {
    Eigen::RowVectorXd row = Eigen::RowVectorXd::Zero(shared + 1);
    row[kPoses] = 1 / size->prior_sd;
    row[shared] = std::log(fit.size) / size->prior_sd;
    model.prior = row.transpose() * row;
  }
  if (known) {
    const AlongResidual residual = along_residual(*known, known->target ? fit.poses.Z : fit.poses.X);
    Eigen::RowVectorXd row = Eigen::RowVectorXd::Zero(shared + 1);
    row.segment<6>(known->target ? 6 : 0) = residual.by_pose;
    row[shared] = residual.value;
    if (model.prior.size() == 0) model.prior.setZero(shared + 1, shared + 1);
    model.prior += row.transpose() * row;
  }
  return model;
}

}  // namespace

LinearLoop linear_loop(const PoseLoop& loop, const HandEyePoses& poses) {
  const Eigen::Isometry3d predicted = poses.X.inverse() * loop.G.inverse() * poses.Z;
  const Eigen::Isometry3d E = predicted.inverse() * loop.C;
  const Eigen::Vector3d angle = rotation_log(E.linear());
  LinearLoop linear;
  linear.residual << E.translation(), angle;
  // Exp(-z) E
  linear.by_predicted << -Eigen::Matrix3d::Identity(), skew(E.translation()), Eigen::Matrix3d::Zero(),
      -right_jacobian_inverse(angle) * E.linear().transpose();
  linear.by_poses << -linear.by_predicted * adjoint(predicted.inverse()), linear.by_predicted;
  linear.by_size << predicted.linear().transpose() * loop.C.translation(), Eigen::Vector3d::Zero();
  linear.sight = line_of_sight(loop, predicted);
  return linear;
}

std::vector<PoseLoop> resized(std::vector<PoseLoop> loops, double size) {
  for (PoseLoop& loop : loops) loop.C.translation() *= size;
  return loops;
}

PoseSpaceFit fit_pose_space(const std::vector<PoseLoop>& loops, const HandEyePoses& seed,
                            const std::optional<SizeUnknown>& size, const std::optional<AlongPrior>& along) {
  PoseSpaceFit fit{.poses = seed, .covariance = {}, .translation = {}};
  std::vector<double> sigmas(kComponents, 1e-2);
  const std::vector<double> floor(kComponents, 1e-7);
  for (int iteration = 0; iteration < 50 && !fit.converged; ++iteration) {
    const LinearModel model = linearize(size ? resized(loops, fit.size) : loops, fit, sigmas, size, along);
    const VarianceComponents estimate = estimate_variance_components(model, sigmas, floor);
    sigmas = estimate.sigmas;
    const LinearSolution solution = solve_linear(model, sigmas);
    fit.poses.X = moved(fit.poses.X, solution.shared.head<6>());
    fit.poses.Z = moved(fit.poses.Z, solution.shared.segment<6>(6));
    if (size) fit.size *= std::exp(std::clamp(solution.shared[kPoses], -0.5, 0.5));
    fit.covariance = adjusted_covariance(model, estimate);
    fit.converged = solution.shared.norm() < 1e-9;
  }
  if (loops.size() > 3) fit.covariance *= tail_growth(3 * static_cast<double>(loops.size()) - 6);
  fit.rotation = sigmas[kRotation];
  fit.translation = {sigmas[kAcross], sigmas[kAlong]};
  return fit;
}

double SightNoise::rms() const { return std::sqrt((2 * across * across + along * along) / 3); }

}  // namespace flash::calib
