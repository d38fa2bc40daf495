#include "calib/solve/errors_in_variables.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "calib/geometry/projection.h"
#include "calib/solve/linearization.h"
#include "data/parallel.h"

namespace flash::calib {
namespace {

// Below these a noise level means an exact robot or an exact corner; smaller ones only cost digits.
constexpr double kFloorPixels = 1e-4, kFloorRotation = 1e-6, kFloorTranslation = 1e-6, kFloorDepth = 1e-5;

std::vector<PoseLoop> loops_of(const Bundle& bundle, const std::vector<BundleView>& views,
                               const std::vector<Eigen::Isometry3d>& T_camera_target) {
  std::vector<PoseLoop> loops;
  loops.reserve(views.size());
  for (const BundleView& view : views) {
    const auto pose = static_cast<std::size_t>(view.pose);
    loops.push_back(pose_loop(bundle.setup, bundle.poses[pose].T_base_gripper, T_camera_target[pose]));
  }
  return loops;
}

void fit(Bundle& bundle, const std::vector<Eigen::Isometry3d>& T_camera_target, Method method,
         const RefineSettings& settings) {
  if (method == Method::errors_in_variables) {
    RefineSettings anew = settings;
    anew.estimate_pivots = false;
    bundle = refine(std::move(bundle), anew).bundle;
    return;
  }
  bundle.scales.assign(bundle.scales.size(), 1.0);
  if (method == Method::bundle) {
    for (RobotPose& pose : bundle.poses) pose.correction.setIdentity();
    solve_bundle(bundle, settings.noise, {.unknowns = {.corrections = false}, .huber = 0});
    return;
  }
  const std::vector<PoseLoop> loops = loops_of(bundle, bundle.views, T_camera_target);
  const HandEyePoses poses = method == Method::park ? park(loops) : shah(loops);
  bundle.cameras.front() = poses.X;
  bundle.targets.front() = poses.Z;
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
    const LinearModel model = linearize(trial, noise, settings);
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

Bundle views_of(const Bundle& bundle, const std::vector<int>& fold, int part, bool inside) {
  Bundle result = bundle;
  std::erase_if(result.views, [&](const BundleView& view) {
    return (fold[static_cast<std::size_t>(view.pose)] == part) != inside;
  });
  return result;
}

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
    model = linearize(result.bundle, result.noise, settings.bundle);
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
    return result;
  }
  const LinearSolution solution = solve_linear(model, to_components(result.noise));
  result.covariance = solution.information.ldlt().solve(
      Eigen::MatrixXd::Identity(solution.information.rows(), solution.information.cols()));
  return result;
}

Eigen::Isometry3d fitted_pose(const data::CameraIntrinsics& camera, const Eigen::Matrix3Xd& points,
                              const Eigen::Matrix2Xd& pixels, Eigen::Isometry3d T_camera_target) {
  const IntrinsicsVector intrinsics = to_vector(camera);
  for (int iteration = 0; iteration < 10; ++iteration) {
    Matrix6d H = Matrix6d::Zero();
    Vector6d g = Vector6d::Zero();
    for (Eigen::Index i = 0; i < points.cols(); ++i) {
      Eigen::Matrix<double, 2, 3> d_q;
      const Eigen::Vector2d r = project(intrinsics, T_camera_target * points.col(i), &d_q) - pixels.col(i);
      Eigen::Matrix<double, 2, 6> J;
      J << d_q * T_camera_target.linear(), -d_q * T_camera_target.linear() * skew(points.col(i));
      H += J.transpose() * J;
      g += J.transpose() * r;
    }
    T_camera_target = moved(T_camera_target, -H.ldlt().solve(g));
  }
  return T_camera_target;
}

Bundle make_bundle(Setup setup, const data::CameraIntrinsics& camera, const Eigen::Matrix3Xd& target_points,
                   const std::vector<Observation>& observations, const HandEyePoses& seed) {
  Bundle bundle{.setup = setup,
                .cameras = {seed.X},
                .intrinsics = {camera},
                .bases = {Eigen::Isometry3d::Identity()},
                .targets = {seed.Z},
                .scales = {1.0},
                .time_offsets = {0.0},
                .pivots = {Eigen::Vector3d::Zero()},
                .poses = {},
                .views = {}};
  for (std::size_t i = 0; i < observations.size(); ++i) {
    const Observation& observation = observations[i];
    RobotPose pose;
    pose.T_base_gripper = observation.T_base_gripper;
    pose.velocity = observation.velocity;
    bundle.poses.push_back(pose);
    BundleView view;
    view.pose = static_cast<int>(i);
    view.points = target_points(Eigen::all, observation.points);
    view.pixels = observation.pixels;
    view.depth_points = observation.depth_points;
    bundle.views.push_back(std::move(view));
  }
  return bundle;
}

const char* to_string(Method method) {
  switch (method) {
    case Method::park:
      return "park";
    case Method::shah:
      return "shah";
    case Method::bundle:
      return "bundle";
    case Method::errors_in_variables:
      break;
  }
  return "errors_in_variables";
}

namespace {

/// Sums of one part of the views, predicted by a solution without them.
struct HeldOutSums {
  double px = 0, mm = 0, deg = 0, corners = 0, views = 0;
};

HeldOutSums hold_out_part(const Bundle& bundle, const std::vector<Eigen::Isometry3d>& T_camera_target,
                          Method method, const RefineSettings& settings, const std::vector<int>& fold,
                          int part) {
  HeldOutSums sums;
  Bundle train = views_of(bundle, fold, part, false);
  fit(train, T_camera_target, method, settings);
  const Bundle test = views_of(bundle, fold, part, true);
  for (const BundleView& view : test.views) {
    const Eigen::Isometry3d predicted = predicted_pose(train, view, false);
    // With lens and size of the target as they were solved for.
    const Eigen::Matrix3Xd points = train.scales[static_cast<std::size_t>(view.target)] * view.points;
    const Eigen::Isometry3d seen =
        fitted_pose(train.intrinsics[static_cast<std::size_t>(view.camera)], points, view.pixels,
                    T_camera_target[static_cast<std::size_t>(view.pose)]);
    const Eigen::Vector3d centre = points.rowwise().mean();
    const double angle = rotation_angle(predicted.linear().transpose() * seen.linear());
    sums.px += residuals(train, view, false).squaredNorm();
    sums.mm += (1e3 * (predicted * centre - seen * centre)).squaredNorm();
    sums.deg += std::pow(angle * 180 / M_PI, 2);
    sums.corners += static_cast<double>(view.points.cols());
    ++sums.views;
  }
  return sums;
}

}  // namespace

HeldOut hold_out(const Bundle& bundle, const std::vector<Eigen::Isometry3d>& T_camera_target, Method method,
                 const RefineSettings& settings, int folds, int threads) {
  const int count = static_cast<int>(bundle.poses.size());
  const int parts = std::min(folds, count);
  HeldOut result;
  for (int i = 0; i < count; ++i) result.fold.push_back(i % parts);
  std::vector<HeldOutSums> sums(static_cast<std::size_t>(parts));
  data::for_each_in_parallel(sums.size(), threads, [&](std::size_t part) {
    sums[part] =
        hold_out_part(bundle, T_camera_target, method, settings, result.fold, static_cast<int>(part));
  });
  HeldOutSums all;
  for (const HeldOutSums& part : sums) {
    all.px += part.px;
    all.mm += part.mm;
    all.deg += part.deg;
    all.corners += part.corners;
    all.views += part.views;
  }
  result.px = std::sqrt(all.px / all.corners);
  result.mm = std::sqrt(all.mm / all.views);
  result.deg = std::sqrt(all.deg / all.views);
  return result;
}

}  // namespace flash::calib
