#include "calib/solve/pose_space.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "calib/geometry/pose.h"
#include "calib/solve/lens_prior.h"
#include "calib/solve/reml.h"

namespace flash::calib {
namespace {

constexpr int kPoses = 12;  // X, then Z
constexpr int kScales = 2;  // size, focal length
constexpr int kColumns = kPoses + kScales + 1;

using Rows = Eigen::Matrix<double, 3, kColumns>;
using Gram = Eigen::Matrix<double, kColumns, kColumns>;

/// Components of variance.
enum Component : int { kRotation, kAcross, kAlong, kComponents };

/// How much of the noise is the camera's.
struct CameraShare {
  double across = 0, along = 0;
};

/// Whatever the noise along the line of sight exceeds that across it by is the camera's.
CameraShare camera_share(const ScalesUnknown& scales, const std::vector<double>& sigmas) {
  const double even = std::min(1.0, std::pow(sigmas[kAcross] / sigmas[kAlong], 2));
  return {scales.camera_share, 1 - (1 - scales.camera_share) * even};
}

/// Of the target as seen, in the frame of the target as predicted; zero where it has none.
Eigen::Vector3d line_of_sight(const PoseLoop& loop, const Eigen::Isometry3d& predicted) {
  constexpr double kNearest = 1e-6;  // [m]
  const double distance = loop.C.translation().norm();
  if (!(distance > kNearest)) return Eigen::Vector3d::Zero();
  return predicted.linear().transpose() * loop.C.translation() / distance;
}

/// Rows of [d_X d_Z d_log_scales residual]: rotation, then translation; and the line of sight.
struct LoopRows {
  Rows rotation, translation;
  Eigen::Vector3d sight;
};

LoopRows rows_of(const PoseLoop& loop, const HandEyePoses& poses, const CameraShare& share) {
  const LinearLoop linear = linear_loop(loop, poses);
  LoopRows rows;
  rows.sight = linear.sight;
  const Eigen::Vector3d dt = linear.residual.head<3>();
  // A residual that is the camera's grows with the scale: that over the scale counts.
  const Eigen::Vector3d along = rows.sight * rows.sight.dot(dt),
                        of_camera = share.across * (dt - along) + share.along * along;
  Eigen::Matrix<double, 3, kScales> d_scales = linear.by_scales.topRows<3>();
  d_scales.col(0) -= of_camera;
  d_scales.col(1) -= linear.axis * linear.axis.dot(of_camera);
  rows.translation << linear.by_poses.topRows<3>(), d_scales, dt;
  rows.rotation << linear.by_poses.bottomRows<3>(), Eigen::Matrix<double, 3, kScales>::Zero(),
      linear.residual.tail<3>();
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

/// Columns of the scales that are unknown, after those of the poses.
std::vector<int> free_scales(const std::optional<ScalesUnknown>& scales) {
  std::vector<int> columns;
  if (scales && scales->size_sd > 0) columns.push_back(kPoses);
  if (scales && scales->focal_length_sd > 0) columns.push_back(kPoses + 1);
  return columns;
}

/// What is known of the scales, as one row each, and of a place: [J_s r_0]^T [J_s r_0].
Gram known_before(const PoseSpaceFit& fit, const std::optional<ScalesUnknown>& scales,
                  const std::optional<AlongPrior>& known) {
  Gram prior = Gram::Zero();
  const auto add = [&](const Eigen::Matrix<double, 1, kColumns>& row, double weight) {
    prior += weight * row.transpose() * row;
  };
  const Eigen::Vector2d logs = fit.scales.logs();
  for (const int column : free_scales(scales)) {
    const double sd = column > kPoses ? scales->focal_length_sd : scales->size_sd,
                 off = logs[column - kPoses] / sd;
    if (!std::isfinite(sd)) continue;
    Eigen::Matrix<double, 1, kColumns> row = Eigen::Matrix<double, 1, kColumns>::Zero();
    row[column] = 1 / sd;
    row[kColumns - 1] = off;
    add(row, 1 / (1 + off * off / kLensTail));
  }
  if (known) {
    const AlongResidual residual = along_residual(*known, known->target ? fit.poses.Z : fit.poses.X);
    Eigen::Matrix<double, 1, kColumns> row = Eigen::Matrix<double, 1, kColumns>::Zero();
    row.segment<6>(known->target ? 6 : 0) = residual.by_pose;
    row[kColumns - 1] = residual.value;
    add(row, 1);
  }
  return prior;
}

LinearModel linearize(const std::vector<PoseLoop>& loops, const PoseSpaceFit& fit,
                      const std::vector<double>& sigmas, const std::optional<ScalesUnknown>& scales,
                      const std::optional<AlongPrior>& known) {
  std::vector<int> columns;
  for (int column = 0; column < kPoses; ++column) columns.push_back(column);
  for (const int column : free_scales(scales)) columns.push_back(column);
  LinearModel model{.groups = 1,
                    .components = kComponents,
                    .own = 0,
                    .shared = static_cast<int>(columns.size()),
                    .blocks = {}};
  columns.push_back(kColumns - 1);
  model.noise = noise_prior(loops.size());
  const CameraShare share = scales ? camera_share(*scales, sigmas) : CameraShare{};
  Gram grams[kComponents] = {Gram::Zero(), Gram::Zero(), Gram::Zero()};
  double counts[kComponents] = {};
  for (const PoseLoop& loop : loops) {
    const LoopRows rows = rows_of(loop, fit.poses, share);
    const Eigen::Matrix<double, 1, kColumns> along = rows.sight.transpose() * rows.translation;
    grams[kRotation] += rows.rotation.transpose() * rows.rotation;
    grams[kAlong] += along.transpose() * along;
    grams[kAcross] += rows.translation.transpose() * rows.translation - along.transpose() * along;
    const double lines = rows.sight.squaredNorm() > 0.5 ? 1 : 0;
    counts[kRotation] += 3;
    counts[kAcross] += 3 - lines;
    counts[kAlong] += lines;
  }
  for (int i = 0; i < kComponents; ++i) model.blocks.push_back({0, i, counts[i], grams[i](columns, columns)});
  model.prior = known_before(fit, scales, known)(columns, columns);
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
  linear.axis = predicted.linear().transpose() * Eigen::Vector3d::UnitZ();
  linear.by_scales.setZero();
  linear.by_scales.topLeftCorner<3, 1>() = predicted.linear().transpose() * loop.C.translation();
  linear.by_scales.topRightCorner<3, 1>() = linear.axis * loop.C.translation().z();
  linear.sight = line_of_sight(loop, predicted);
  return linear;
}

Eigen::Vector2d SeenScales::logs() const { return {std::log(size), std::log(focal_length)}; }

Eigen::Isometry3d rescaled(Eigen::Isometry3d T_camera_target, const SeenScales& scales) {
  T_camera_target.translation() *= scales.size;
  T_camera_target.translation().z() *= scales.focal_length;
  return T_camera_target;
}

std::vector<PoseLoop> rescaled(std::vector<PoseLoop> loops, const SeenScales& scales) {
  for (PoseLoop& loop : loops) loop.C = rescaled(loop.C, scales);
  return loops;
}

PoseSpaceFit fit_pose_space(const std::vector<PoseLoop>& loops, const HandEyePoses& seed,
                            const std::optional<ScalesUnknown>& scales,
                            const std::optional<AlongPrior>& along) {
  constexpr double kFarthest = 0.5;  // step of a log
  PoseSpaceFit fit{.poses = seed, .covariance = {}, .scales = {}, .translation = {}};
  std::vector<double> sigmas(kComponents, 1e-2);
  const std::vector<double> floor(kComponents, 1e-7);
  const std::vector<int> columns = free_scales(scales);
  for (int iteration = 0; iteration < 50 && !fit.converged; ++iteration) {
    const LinearModel model =
        linearize(scales ? rescaled(loops, fit.scales) : loops, fit, sigmas, scales, along);
    const VarianceComponents estimate = estimate_variance_components(model, sigmas, floor);
    sigmas = estimate.sigmas;
    const LinearSolution solution = solve_linear(model, sigmas);
    fit.poses.X = moved(fit.poses.X, solution.shared.head<6>());
    fit.poses.Z = moved(fit.poses.Z, solution.shared.segment<6>(6));
    for (std::size_t i = 0; i < columns.size(); ++i) {
      double& scale = columns[i] == kPoses ? fit.scales.size : fit.scales.focal_length;
      scale *=
          std::exp(std::clamp(solution.shared[kPoses + static_cast<Eigen::Index>(i)], -kFarthest, kFarthest));
    }
    fit.covariance = adjusted_covariance(model, estimate);
    fit.converged = solution.shared.norm() < 1e-9;
  }
  if (loops.size() > 3) fit.covariance *= tail_growth(3 * static_cast<double>(loops.size()) - 6);
  if (scales) {
    std::vector<int> kept(kPoses);
    std::iota(kept.begin(), kept.end(), 0);
    kept.insert(kept.end(), columns.begin(), columns.end());
    const Eigen::MatrixXd found = fit.covariance;
    fit.covariance = Eigen::MatrixXd::Zero(kPoses + kScales, kPoses + kScales);
    fit.covariance(kept, kept) = found;
  }
  fit.rotation = sigmas[kRotation];
  fit.translation = {sigmas[kAcross], sigmas[kAlong]};
  return fit;
}

double SightNoise::rms() const { return std::sqrt((2 * across * across + along * along) / 3); }

}  // namespace flash::calib
