#include "calib/solve/errors_in_variables.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "calib/solve/linearization.h"

namespace flash::calib {
namespace {

// Below these a noise level means an exact robot or an exact corner; smaller ones only cost digits.
constexpr double kFloorPixels = 1e-4, kFloorRotation = 1e-6, kFloorTranslation = 1e-6, kFloorDepth = 1e-5;

/// Few poses hardly tell how noisy they are, and their likelihood is often highest where one kind of noise is
/// none: what is usual of corners, arms and depth cameras then counts, within a factor of three.
constexpr std::size_t kFewPoses = 8;
constexpr double kUsualPixels = 0.2, kUsualRotation = 0.1 * M_PI / 180, kUsualTranslation = 1e-3,
                 kUsualDepth = 2e-3;

LinearModel linear_model(const Bundle& bundle, const NoiseLevels& noise, const BundleSettings& settings) {
  LinearModel model = linearize(bundle, noise, settings);
  if (settings.unknowns.corrections && bundle.poses.size() < kFewPoses * bundle.bases.size())
    model.noise = {
        to_components(uniform_noise(bundle, kUsualPixels, kUsualRotation, kUsualTranslation, kUsualDepth)),
        1};
  return model;
}

/// Middle of what each arm's gripper saw or held, in the gripper.
std::vector<Eigen::Vector3d> target_places(const Bundle& bundle) {
  std::vector<Eigen::Vector3d> places(bundle.bases.size(), Eigen::Vector3d::Zero());
  std::vector<double> counts(places.size(), 0);
  for (const BundleView& view : bundle.views) {
    const RobotPose& pose = bundle.poses[static_cast<std::size_t>(view.pose)];
    const auto arm = static_cast<std::size_t>(pose.arm), target = static_cast<std::size_t>(view.target),
               camera = static_cast<std::size_t>(view.camera);
    const Eigen::Vector3d centre = view.points.rowwise().mean();
    places[arm] += bundle.setup == Setup::eye_to_hand
                       ? bundle.targets[target] * centre
                       : bundle.cameras[camera] * (predicted_pose(bundle, view) * centre);
    ++counts[arm];
  }
  for (std::size_t arm = 0; arm < places.size(); ++arm) places[arm] /= std::max(1.0, counts[arm]);
  return places;
}

/// Moves the pivots to the share of the way to the target that the restricted likelihood prefers, if it does
/// so clearly. Errors of a lens turn the view about the target, those of a wrist about the gripper.
bool choose_pivots(Bundle& bundle, const NoiseLevels& noise, const BundleSettings& settings,
                   const std::vector<double>& floor) {
  constexpr double kClearly = 2;  // of the deviance, for one more parameter (Akaike 1974)
  if (!settings.unknowns.corrections) return false;
  const std::vector<Eigen::Vector3d> places = target_places(bundle);
  const std::vector<double> start = to_components(noise);
  Bundle trial = bundle;
  double least = 0, share_of_least = 0;
  for (const double share : {0.0, 0.25, 0.5, 0.75, 1.0}) {
    for (std::size_t arm = 0; arm < places.size(); ++arm) trial.pivots[arm] = share * places[arm];
    const LinearModel model = linear_model(trial, noise, settings);
    const VarianceComponents estimate = estimate_variance_components(model, start, floor);
    const double deviance = solve_linear(model, estimate.sigmas).deviance + (share > 0 ? kClearly : 0);
    if (share > 0 && deviance >= least) continue;
    least = deviance;
    share_of_least = share;
  }
  for (std::size_t arm = 0; arm < places.size(); ++arm) bundle.pivots[arm] = share_of_least * places[arm];
  return share_of_least > 0;
}

}  // namespace

NoiseLevels uniform_noise(const Bundle& bundle, double corner, double rotation, double translation,
                          double depth) {
  const std::size_t cameras = bundle.cameras.size(), arms = bundle.bases.size();
  return {std::vector<double>(cameras, corner), std::vector<double>(arms, rotation),
          std::vector<double>(arms, translation), std::vector<double>(cameras, depth)};
}

Refinement refine(Bundle bundle, const RefineSettings& settings) {
  Refinement result{
      .bundle = std::move(bundle), .noise = settings.noise, .covariance = {}, .noise_log_sd = {}};
  if (result.noise.corner.empty()) result.noise = uniform_noise(result.bundle, 0.5, 3e-3, 3e-3, 3e-3);
  const std::vector<double> floor = to_components(
      uniform_noise(result.bundle, kFloorPixels, kFloorRotation, kFloorTranslation, kFloorDepth));
  LinearModel model;
  VarianceComponents estimate;
  bool pivots_chosen = !settings.estimate_noise || !settings.estimate_pivots;
  for (; result.rounds < settings.rounds && !result.converged; ++result.rounds) {
    const BundleSummary summary = solve_bundle(result.bundle, result.noise, settings.bundle);
    model = linear_model(result.bundle, result.noise, settings.bundle);
    if (!settings.estimate_noise) {
      result.converged = summary.converged;
      break;
    }
    estimate = estimate_variance_components(model, to_components(result.noise), floor);
    result.converged = summary.converged && estimate.gain < settings.tolerance;
    if (!result.converged) result.noise = to_noise(estimate.sigmas, result.noise);
    if (result.converged && !pivots_chosen) {
      pivots_chosen = true;
      result.converged = !choose_pivots(result.bundle, result.noise, settings.bundle, floor);
    }
  }
  if (settings.estimate_noise) {
    result.noise_log_sd = estimate.log_covariance.diagonal().cwiseSqrt();
    result.covariance = adjusted_covariance(model, estimate);
    // Of the robot's rotations, or translations: three a pose, less half of the twelve of X and Z.
    if (model.noise.spread > 0 && result.bundle.poses.size() > 3)
      result.covariance *= tail_growth(3 * static_cast<double>(result.bundle.poses.size()) - 6);
    return result;
  }
  const LinearSolution solution = solve_linear(model, to_components(result.noise));
  result.covariance = solution.information.ldlt().solve(
      Eigen::MatrixXd::Identity(solution.information.rows(), solution.information.cols()));
  return result;
}

}  // namespace flash::calib
