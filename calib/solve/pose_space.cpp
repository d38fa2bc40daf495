#include "calib/solve/pose_space.h"

#include <Eigen/Cholesky>
#include <algorithm>
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
  for (const PoseLoop& loop : loops) {
    const auto [rotation, translation] = rows_of(loop, poses);
    model.blocks.push_back({0, 0, 3, rotation.transpose() * rotation});
    model.blocks.push_back({0, 1, 3, translation.transpose() * translation});
  }
  return model;
}

std::vector<PoseLoop> loops_of(Setup setup, const std::vector<Observation>& observations) {
  std::vector<PoseLoop> loops;
  loops.reserve(observations.size());
  for (const Observation& o : observations)
    loops.push_back(pose_loop(setup, o.T_base_gripper, o.T_camera_target.front()));
  return loops;
}

template <class Fit>
HeldOut hold_out_pairs(const std::vector<PoseLoop>& loops, int folds, const Fit& fit) {
  const int count = static_cast<int>(loops.size()), parts = std::min(folds, count);
  HeldOut held;
  for (int part = 0; part < parts; ++part) {
    std::vector<PoseLoop> train, test;
    for (int i = 0; i < count; ++i)
      (i % parts == part ? test : train).push_back(loops[static_cast<std::size_t>(i)]);
    const ClosingError error = closing_rms(test, fit(train));
    held.mm += std::pow(1e3 * error.translation, 2) * static_cast<double>(test.size()) / count;
    held.deg += std::pow(error.rotation * 180 / M_PI, 2) * static_cast<double>(test.size()) / count;
  }
  for (int i = 0; i < count; ++i) held.fold.push_back(i % parts);
  held.mm = std::sqrt(held.mm);
  held.deg = std::sqrt(held.deg);
  return held;
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
  fit.rotation = sigmas[0];
  fit.translation = sigmas[1];
  return fit;
}

Calibration calibrate_pairs(Setup setup, const std::vector<Observation>& all,
                            const CalibrateSettings& settings) {
  Calibration result;
  result.setup = setup;
  const std::vector<Observation> observations = prepare(result, all, {Symmetry{}}, settings);
  const std::vector<PoseLoop> loops = loops_of(setup, observations);
  const PoseSpaceFit fit = fit_pose_space(loops, shah(loops));
  result.poses = fit.poses;
  result.covariance = fit.covariance.topLeftCorner<6, 6>();
  result.refined.noise = {{0.0}, {fit.rotation}, {fit.translation}, {0.0}};
  result.refined.converged = fit.converged;
  for (const ReferenceMethod& reference : reference_methods(loops)) {
    result.comparison.push_back({reference.name, reference.poses, reference.relative, 0, {}, reference.wild});
    if (reference.name == "park")
      result.comparison.back().held_out = hold_out_pairs(loops, settings.folds, park);
    if (reference.name == "shah")
      result.comparison.back().held_out = hold_out_pairs(loops, settings.folds, shah);
  }
  result.held_out = hold_out_pairs(loops, settings.folds, [](const std::vector<PoseLoop>& train) {
    return fit_pose_space(train, shah(train)).poses;
  });
  result.comparison.push_back(
      {"pose_space", fit.poses, relative_rms(loops, fit.poses.X), 0, result.held_out, false});
  finish(result, observations);
  return result;
}

}  // namespace flash::calib
