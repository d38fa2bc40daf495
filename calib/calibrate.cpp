#include "calib/calibrate.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "calib/linearization.h"
#include "calib/projection.h"
#include "data/error.h"

namespace flash::calib {
namespace {

constexpr double kDegree = M_PI / 180;

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

std::vector<PoseLoop> loops_of(Setup setup, const std::vector<Observation>& observations) {
  std::vector<PoseLoop> loops;
  loops.reserve(observations.size());
  for (const Observation& o : observations)
    loops.push_back(pose_loop(setup, o.T_base_gripper, o.T_camera_target.front()));
  return loops;
}

std::vector<Eigen::Isometry3d> target_poses(const std::vector<Observation>& observations) {
  std::vector<Eigen::Isometry3d> poses;
  poses.reserve(observations.size());
  for (const Observation& o : observations) poses.push_back(o.T_camera_target.front());
  return poses;
}

void expect_enough(std::size_t used, std::size_t all, int least) {
  if (used >= static_cast<std::size_t>(least)) return;
  throw data::InputError(std::to_string(used) + " of " + std::to_string(all) +
                         " views can be used: at least " + std::to_string(least) +
                         " are needed, and 12 or more for an answer to trust; add views");
}

/// Refuses input that closes only when it is read otherwise than stated, or not at all.
void expect_convention(Setup setup, const std::vector<Observation>& observations,
                       const std::vector<Symmetry>& symmetries, const Consistency& stated,
                       const CalibrateSettings& settings) {
  const std::optional<Finding> finding =
      diagnose(setup, observations, symmetries, stated, settings.angles, settings.doctor);
  if (finding) throw data::InputError(finding->sentence);
  if (stated.found && stated.score < settings.hopeless) return;
  char text[240];
  std::snprintf(
      text, sizeof text,
      "robot and camera do not tell of the same motion: most views close to no better than %.1f deg and "
      "%.0f mm, and no other convention explains them; check that each image stands beside its pose",
      stated.rotation / kDegree, 1e3 * stated.translation);
  throw data::InputError(text);
}

/// Squared length of each correction in its own noise levels: near chi-square with six degrees of freedom. No
/// robot is taken to be better than 0.1 mm and 0.1 mrad.
std::vector<double> squared_corrections(const Refinement& refined) {
  constexpr double kLeast = 1e-4;
  std::vector<double> squared;
  for (const RobotPose& pose : refined.bundle.poses) {
    const auto arm = static_cast<std::size_t>(pose.arm);
    const Eigen::Vector3d& pivot = refined.bundle.pivots[arm];
    squared.push_back((pose.correction * pivot - pivot).squaredNorm() /
                          std::pow(std::max(kLeast, refined.noise.translation[arm]), 2) +
                      rotation_log(pose.correction.linear()).squaredNorm() /
                          std::pow(std::max(kLeast, refined.noise.rotation[arm]), 2));
  }
  return squared;
}

/// Drops the view whose correction no longer looks like those of most views; false where there is none.
bool drop_worst(Calibration& result, std::vector<Observation>& observations, double surprise) {
  const std::vector<double> squared = squared_corrections(result.refined);
  const auto worst = static_cast<std::size_t>(
      std::distance(squared.begin(), std::max_element(squared.begin(), squared.end())));
  constexpr double kMedianOfChiSquare6 = 5.348;
  const double usual = std::max(median(squared) / kMedianOfChiSquare6, 1e-12);
  // Corrections far inside the corner noise say nothing.
  if (squared[worst] < surprise * std::max(usual, 0.05)) return false;
  const Vector6d xi =
      motion_between(Eigen::Isometry3d::Identity(), result.refined.bundle.poses[worst].correction);
  char text[160];
  std::snprintf(
      text, sizeof text,
      "would need its robot pose corrected by %.2f deg and %.1f mm, %.0f times what most views need",
      xi.tail<3>().norm() / kDegree, 1e3 * xi.head<3>().norm(), std::sqrt(squared[worst] / (6 * usual)));
  ViewVerdict& verdict = result.repair.views[static_cast<std::size_t>(result.used[worst])];
  verdict.used = false;
  verdict.reason = text;
  observations.erase(observations.begin() + static_cast<std::ptrdiff_t>(worst));
  result.used.erase(result.used.begin() + static_cast<std::ptrdiff_t>(worst));
  return true;
}

void report_views(Calibration& result) {
  result.views.resize(result.repair.views.size());
  for (std::size_t i = 0; i < result.views.size(); ++i) {
    result.views[i].used = result.repair.views[i].used;
    result.views[i].reason = result.repair.views[i].reason;
  }
  const Bundle& bundle = result.refined.bundle;
  for (const BundleView& view : bundle.views) {
    ViewResult& entry =
        result.views[static_cast<std::size_t>(result.used[static_cast<std::size_t>(view.pose)])];
    const auto rms = [&](bool corrected) {
      return std::sqrt(residuals(bundle, view, corrected).squaredNorm() /
                       static_cast<double>(view.points.cols()));
    };
    entry.px = rms(true);
    entry.chain_px = rms(false);
    entry.correction = motion_between(Eigen::Isometry3d::Identity(),
                                      bundle.poses[static_cast<std::size_t>(view.pose)].correction);
  }
}

/// Of the projected middle of the target against where the view's own pose puts it.
double centre_rms(const Bundle& bundle, const std::vector<Eigen::Isometry3d>& T_camera_target) {
  double sum = 0;
  for (const BundleView& view : bundle.views) {
    const IntrinsicsVector intrinsics = to_vector(bundle.intrinsics.front());
    const Eigen::Vector3d centre = view.points.rowwise().mean();
    sum += (project(intrinsics, predicted_pose(bundle, view, false) * centre) -
            project(intrinsics, T_camera_target[static_cast<std::size_t>(view.pose)] * centre))
               .squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(bundle.views.size()));
}

void compare_methods(Calibration& result, const std::vector<Observation>& observations, const Bundle& plain,
                     const CalibrateSettings& settings) {
  const std::vector<PoseLoop> loops = loops_of(result.setup, observations);
  const std::vector<Eigen::Isometry3d> poses = target_poses(observations);
  Bundle bundle = plain;
  const auto hold = [&](Method method) {
    return hold_out(result.refined.bundle, poses, method, result.refined.noise, settings.refine.bundle,
                    settings.folds);
  };
  for (const ReferenceMethod& reference : reference_methods(loops)) {
    ComparedMethod& method = result.comparison.emplace_back();
    method.name = reference.name;
    method.poses = reference.poses;
    method.relative = reference.relative;
    method.wild = reference.wild;
    bundle.cameras.front() = reference.poses.X;
    bundle.targets.front() = reference.poses.Z;
    method.px = reprojection_rms(bundle, false);
    if (reference.name == "park") method.held_out = hold(Method::park);
    if (reference.name == "shah") method.held_out = hold(Method::shah);
  }
  for (const Method kind : {Method::bundle, Method::errors_in_variables}) {
    const Bundle& solved = kind == Method::bundle ? plain : result.refined.bundle;
    ComparedMethod& method = result.comparison.emplace_back();
    method.name = to_string(kind);
    method.poses = {solved.cameras.front(), solved.targets.front()};
    method.relative = relative_rms(loops, method.poses.X);
    method.px = reprojection_rms(solved, false);
    method.held_out = hold(kind);
  }
  result.held_out = *result.comparison.back().held_out;
}

/// The target's size as one more unknown; none where nothing tells it, as of a robot that turns and never
/// moves along, without depth.
std::optional<ScaleCheck> check_scale(const Refinement& refined, const RefineSettings& settings) {
  // Lengths that the robot only seems to move, three a view with the size of its noise, look like knowledge
  // of the scale, and pull it down by their share. Below a hundredth of the whole that is of no account.
  constexpr double kClear = 100;
  RefineSettings with_scale = settings;
  with_scale.estimate_pivots = false;
  with_scale.noise = refined.noise;
  with_scale.bundle.unknowns.scales = true;
  const int column = shared_columns(refined.bundle, with_scale.bundle.unknowns).scales.front();
  const Eigen::MatrixXd information =
      solve_linear(linearize(refined.bundle, refined.noise, with_scale.bundle), to_components(refined.noise))
          .information;
  const double variance = information.ldlt().solve(Eigen::VectorXd::Unit(information.rows(), column))[column];
  const double seeming = 3 * static_cast<double>(refined.bundle.poses.size());
  if (!(variance > 0 && variance * kClear * seeming < 1)) return std::nullopt;
  const Refinement scaled = refine(refined.bundle, with_scale);
  return ScaleCheck{scaled.bundle.scales.front(), std::sqrt(scaled.covariance(column, column))};
}

/// Halves of few views determine too little by themselves.
void check_splits(Calibration& result, const CalibrateSettings& settings) {
  if (result.used.size() < 4 * static_cast<std::size_t>(settings.least_views)) return;
  result.interleaved = check_halves(result.refined, settings.refine.bundle, Split::interleaved);
  result.consecutive = check_halves(result.refined, settings.refine.bundle, Split::consecutive);
  const double inflation = split_inflation(*result.consecutive);
  if (inflation == 1) return;
  result.covariance *= inflation;
  char text[240];
  std::snprintf(
      text, sizeof text,
      "first and second half of the views differ by %.1f mm and %.2f deg, more than noise explains: drift, "
      "or errors that depend on the pose; the stated standard deviations were raised by %.1f",
      1e3 * result.consecutive->apart.head<3>().norm(), result.consecutive->apart.tail<3>().norm() / kDegree,
      std::sqrt(inflation));
  result.warnings.emplace_back(text);
}

void warn_of_scale(Calibration& result) {
  if (!result.scale) return;
  const double off = std::abs(result.scale->estimate - 1), sd = result.scale->sd;
  if (off < 0.01 || off < 5 * sd) return;
  char text[240];
  std::snprintf(text, sizeof text,
                "the data want a target %.4f +- %.4f times as large as stated: measure its squares, or the "
                "intrinsics or the robot's unit are wrong",
                result.scale->estimate, 2 * sd);
  result.warnings.insert(result.warnings.begin(), text);
  if (off > 0.03) result.usable = false;
}

void warn(Calibration& result) {
  std::size_t missing = 0;
  for (const ViewResult& view : result.views) missing += view.used ? 0 : 1;
  if (result.used.size() < 10)
    result.warnings.push_back(
        std::to_string(result.used.size()) +
        " views: noise levels and uncertainty are themselves uncertain; 15 or more are better");
  if (missing > 0)
    result.warnings.push_back(std::to_string(missing) + " of " + std::to_string(result.views.size()) +
                              " views were not used");
  if (result.repair.renumbered > 0)
    result.warnings.push_back(std::to_string(result.repair.renumbered) +
                              " views had the target numbered from its other end; put right");
  if (!result.refined.converged) {
    result.warnings.insert(result.warnings.begin(), "the refinement did not converge");
    result.usable = false;
  }
}

}  // namespace

std::vector<Observation> prepare(Calibration& result, const std::vector<Observation>& all,
                                 const std::vector<Symmetry>& symmetries, const CalibrateSettings& settings) {
  std::vector<Eigen::Isometry3d> reported;
  for (const Observation& observation : all)
    if (!observation.T_camera_target.empty()) reported.push_back(observation.T_base_gripper);
  expect_enough(reported.size(), all.size(), settings.least_views);
  const std::string reason = degeneracy(rotation_diversity(reported));
  if (!reason.empty()) throw data::InputError(reason);
  result.repair = repair_views(result.setup, all, symmetries, settings.repair);
  expect_convention(result.setup, all, symmetries, result.repair.consistency, settings);
  std::vector<Observation> observations = used_observations(result.repair, &result.used);
  expect_enough(observations.size(), all.size(), settings.least_views);
  return observations;
}

void finish(Calibration& result, const std::vector<Observation>& used) {
  report_views(result);
  std::vector<Eigen::Isometry3d> robot;
  std::vector<double> distances;
  for (const Observation& observation : used) {
    robot.push_back(observation.T_base_gripper);
    distances.push_back(observation.T_camera_target.front().translation().norm());
  }
  result.diversity = rotation_diversity(robot);
  result.weakest = weakest_direction(result.covariance, median(distances), "camera");
  warn(result);
  warn_of_scale(result);
}

Calibration calibrate(Setup setup, const data::CameraIntrinsics& camera, const Eigen::Matrix3Xd& points,
                      const std::vector<Symmetry>& symmetries, const std::vector<Observation>& all,
                      const CalibrateSettings& settings) {
  Calibration result;
  result.setup = setup;
  std::vector<Observation> observations = prepare(result, all, symmetries, settings);

  Bundle plain;
  for (;;) {
    const HandEyePoses seed = shah(loops_of(setup, observations));
    plain = make_bundle(setup, camera, points, observations, seed);
    result.refined = refine(plain, settings.refine);
    if (observations.size() <= static_cast<std::size_t>(settings.least_views)) break;
    if (!drop_worst(result, observations, settings.surprise)) break;
  }
  BundleSettings exact_robot = settings.refine.bundle;
  exact_robot.unknowns.corrections = false;
  exact_robot.huber = 0;
  solve_bundle(plain, result.refined.noise, exact_robot);

  const Bundle& bundle = result.refined.bundle;
  result.poses = {bundle.cameras.front(), bundle.targets.front()};
  result.covariance = result.refined.covariance.topLeftCorner<6, 6>();
  result.corner_rms = reprojection_rms(bundle, true);
  result.chain_rms = reprojection_rms(bundle, false);
  result.centre_rms = centre_rms(bundle, target_poses(observations));
  compare_methods(result, observations, plain, settings);
  check_splits(result, settings);
  if (settings.check_scale) result.scale = check_scale(result.refined, settings.refine);
  finish(result, observations);
  return result;
}

}  // namespace flash::calib
