#include "calib/calibrate/calibrate_pairs.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "calib/calibrate/pair_scales.h"
#include "calib/calibrate/stated_uncertainty.h"
#include "calib/solve/pose_space.h"
#include "calib/uncertainty/smooth_errors_of_pairs.h"
#include "calib/uncertainty/step_of_pairs.h"
#include "data/files/error.h"
#include "data/numbers/chi_square.h"

namespace flash::calib {
namespace {

/// Closed forms go through all pairs of pairs, which is why of many an even share takes part.
std::vector<PoseLoop> thinned(const std::vector<PoseLoop>& loops) {
  const std::size_t count = std::min(loops.size(), most_pairs_compared);
  std::vector<PoseLoop> some;
  for (std::size_t i = 0; i < count; ++i) some.push_back(loops[i * loops.size() / count]);
  return some;
}

template <class Fit>
HeldOut hold_out_pairs(const std::vector<PoseLoop>& loops, const CalibrateSettings& settings,
                       const Fit& fit) {
  const int count = static_cast<int>(loops.size()), parts = std::min(settings.folds, count);
  HeldOut held;
  held.fold = parts_of(count, settings.folds, settings.held_out_seed);
  for (int part = 0; part < parts; ++part) {
    std::vector<PoseLoop> train, test;
    for (int i = 0; i < count; ++i)
      (held.fold[static_cast<std::size_t>(i)] == part ? test : train)
          .push_back(loops[static_cast<std::size_t>(i)]);
    const ClosingError error = closing_rms(test, fit(train));
    held.mm += std::pow(1e3 * error.translation, 2) * static_cast<double>(test.size()) / count;
    held.deg += std::pow(error.rotation * 180 / M_PI, 2) * static_cast<double>(test.size()) / count;
  }
  held.mm = std::sqrt(held.mm);
  held.deg = std::sqrt(held.deg);
  return held;
}

/// Halves of the pairs in time and by the gripper's places, each solved by itself: where they put the camera
/// must agree, and in time the target too. Else something moved meanwhile, or the robot errs by its pose.
void check_halves(Calibration& result, const std::vector<PoseLoop>& loops,
                  const std::vector<Eigen::Vector3d>& places, const std::optional<AlongPrior>& along) {
  constexpr std::size_t kEnough = 16;
  if (loops.size() < kEnough) return;
  std::vector<SplitCheck> checks;
  for (const Split split : {Split::consecutive, Split::place_1, Split::place_2, Split::place_3}) {
    const std::vector<int> half = halves_of(places, split);
    std::vector<PoseLoop> parts[2];
    for (std::size_t i = 0; i < loops.size(); ++i) parts[half[i]].push_back(loops[i]);
    PoseSpaceFit fits[2];
    for (int k = 0; k < 2; ++k)
      fits[k] = fit_pose_space(parts[k], better_of(parts[k], shah(parts[k]), result.poses), {}, along);
    const auto check = [&](const Eigen::Isometry3d& before, const Eigen::Isometry3d& after, Eigen::Index at) {
      SplitCheck halves{.split = split, .apart = motion_between(before, after)};
      const Matrix6d covariance = (fits[0].covariance + fits[1].covariance).block<6, 6>(at, at);
      halves.chi_square = halves.apart.dot(covariance.ldlt().solve(halves.apart));
      return halves;
    };
    checks.push_back(check(fits[0].poses.X, fits[1].poses.X, 0));
    if (split == Split::consecutive) checks.push_back(check(fits[0].poses.Z, fits[1].poses.Z, 6));
  }
  const SplitCheck* const target = &checks[1];
  result.splits = {checks.front()};
  const SplitCheck* worst = nullptr;
  result.covariance_factor = split_inflation(checks, &worst);
  if (worst == nullptr) return;
  result.splits = {*worst};
  const double grown = growth(result.repeatable, result.covariance);
  result.repeatable *= result.covariance_factor;
  result.covariance *= std::max(1.0, result.covariance_factor / grown);
  raise_to(result.repeatable, result.covariance);
  char text[300];
  std::snprintf(
      text, sizeof text,
      "%s put the %s at places %.1f mm and %.2f deg apart, more than noise explains: camera or target "
      "moved meanwhile, or the robot's errors depend on its pose; the stated standard deviations were "
      "raised by %.1f",
      describe(worst->split).c_str(), worst == target ? "target" : "camera",
      1e3 * worst->apart.head<3>().norm(), worst->apart.tail<3>().norm() * 180 / M_PI,
      std::sqrt(result.covariance_factor));
  result.warnings.emplace_back(text);
}

/// Robot and target that are exchanged close as well, and so do both inverted. What tells it is where a
/// camera can see a target: before it, and not far off its axis.
void tell_unseen(Calibration& result, const std::vector<Observation>& observations) {
  const Unseen unseen = unseen_targets(observations);
  if (!unseen.plainly()) return;
  tell_first(result,
             "the target is behind the camera, or more than 75 deg off its axis, in " +
                 std::to_string(unseen.count) + " of " + std::to_string(unseen.of) +
                 " pairs, where no camera sees it: are the poses of robot and target exchanged, or inverted?",
             false);
}

/// Exchanged pairs of a camera in the hand have X and Z exchanged and inverted: a camera that seems far from
/// the gripper, and farther than the target from the robot's base.
void tell_exchanged(Calibration& result) {
  constexpr double kFarthest = 0.3;  // of cameras in a hand [m]
  const double camera = result.poses.X.translation().norm(), target = result.poses.Z.translation().norm();
  if (result.setup != Setup::eye_in_hand || result.along || camera < std::max(kFarthest, target)) return;
  char text[240];
  std::snprintf(text, sizeof text,
                "the camera is %.2f m from the gripper, and the target %.2f m from the robot's base: are the "
                "poses of robot and target exchanged? Such pairs close as well",
                camera, target);
  tell_first(result, text, false);
}

/// A camera or a target that moved at once, of all pairs in their order. Where it did so plainly, and the
/// stated deviations do not hold it, there is no answer.
void tell_step(Calibration& result, const std::vector<Observation>& all, SeenScales scales) {
  std::vector<PoseLoop> loops;
  std::vector<std::string> names;
  for (const Observation& pair : all) {
    if (pair.T_camera_target.empty()) continue;
    loops.push_back(pose_loop(result.setup, pair.T_base_gripper, pair.T_camera_target.front()));
    names.push_back(pair.image);
  }
  scales.size *= result.size_begun;
  const auto step = step_of_pairs(rescaled(std::move(loops), scales), result.poses);
  if (!step) return;
  constexpr double kPlain = 5;  // scatters: nothing else parts pairs so far
  const bool held = step->distance < kPlain ||
                    step->motion.dot(result.covariance.ldlt().solve(step->motion)) < data::chi_square_95_of_6;
  char text[300];
  std::snprintf(text, sizeof text,
                "the %s %s by %.1f mm and %.2f deg before %s: what stands before it and since are two "
                "recordings%s; solve each by itself",
                step->of_target ? "target" : "camera", held ? "seems to have moved" : "moved",
                1e3 * step->motion.head<3>().norm(), step->motion.tail<3>().norm() * 180 / M_PI,
                names[step->first].c_str(), held ? ", or the robot errs by its place" : "");
  tell_first(result, text, !held);
}

/// What errors that change smoothly with the robot's pose may have done, beside what scatters.
void add_smooth_errors(Calibration& result, const std::vector<Observation>& observations,
                       const std::vector<PoseLoop>& loops, const PoseSpaceFit& fit, const PairScales& scales,
                       const std::optional<AlongPrior>& along) {
  std::vector<Eigen::Isometry3d> poses;
  for (const Observation& observation : observations) poses.push_back(observation.T_base_gripper);
  const SmoothErrorsOfPairs smooth = smooth_errors_of_pairs(
      result.setup, poses, loops, fit, {result.covariance, scales.covariance, scales.information}, along);
  result.pose_errors = smooth.arm;
  result.covariance = smooth.covariance;
  raise_to(result.repeatable, result.covariance);
  const auto raise = [&](TargetSize& scale, Eigen::Index i) {
    if (scale.sd > 0) scale.sd = std::max(scale.sd, scale.estimate * std::sqrt(smooth.scales(i, i)));
  };
  raise(*result.size, 0);
  if (result.focal_length) raise(*result.focal_length, 1);
  tell_smooth_errors(result, growth(result.repeatable, result.covariance));
}

}  // namespace

Calibration calibrate_pairs(Setup setup, const std::vector<Observation>& all,
                            const CalibrateSettings& settings) {
  Calibration result;
  result.setup = setup;
  const std::vector<Observation> observations = prepare(result, all, {Symmetry{}}, settings);
  std::vector<Eigen::Vector3d> places;
  for (const Observation& observation : observations)
    places.push_back(observation.T_base_gripper.translation());
  std::vector<PoseLoop> loops = pose_loops(setup, observations);
  // Half turns about three axes leave Shah's equations several solutions.
  const HandEyePoses seed = better_of(loops, shah(loops), result.selection.robust_seed.poses);
  const std::optional<OneAxis> axis = axis_of(setup, observations, settings);
  std::optional<AlongPrior> along;
  const double distance = usual_distance(observations);
  if (axis) along = loose_along(*axis, seed, distance);
  const PairScales scales = settle_scales(loops, observations, seed, along, settings);
  result.size = scales.size;
  result.focal_length = scales.focal_length;
  PoseSpaceFit fit = fit_pose_space(loops, seed, {}, along);
  if (axis) {
    // The robot's turns are taken as they are reported: their noise pulls the place as far as the target.
    const SettledPlace settled = settle_along(*axis, *along, fit.poses, fit.covariance.topLeftCorner<6, 6>(),
                                              fit.rotation, distance, distance, settings.height);
    result.along = settled.place;
    if (settled.hold) {
      along = settled.hold;
      fit = fit_pose_space(loops, moved_to(*along, *axis, fit.poses), {}, along);
    }
  }
  result.poses = fit.poses;
  result.covariance = result.repeatable = fit.covariance.topLeftCorner<6, 6>();
  result.refined.noise = {{0.0}, {fit.rotation}, {fit.translation.rms()}, {0.0}};
  result.sight_noise = fit.translation;
  result.refined.converged = fit.converged;
  const std::vector<PoseLoop> compared = thinned(loops);
  result.comparison = compare_closed_forms(compared, settings.closed_forms);
  for (ComparedMethod& method : result.comparison) {
    if (method.name == "park") method.held_out = hold_out_pairs(compared, settings, park);
    if (method.name == "shah") method.held_out = hold_out_pairs(compared, settings, shah);
  }
  result.held_out = hold_out_pairs(loops, settings, [&](const std::vector<PoseLoop>& train) {
    return fit_pose_space(train, better_of(train, shah(train), fit.poses), {}, along).poses;
  });
  result.use = use_error(Use::workspace, result.held_out, std::nullopt);
  result.comparison.push_back({.name = "pose_space",
                               .poses = fit.poses,
                               .relative = relative_rms(compared, fit.poses.X),
                               .held_out = result.held_out});
  const Eigen::Matrix<double, 6, 2> by_scales = camera_by_scales(loops, fit.poses, along);
  result.covariance += by_scales * scales.covariance * by_scales.transpose();
  result.repeatable += by_scales * scales.repeatable * by_scales.transpose();
  add_smooth_errors(result, observations, loops, fit, scales, along);
  const Eigen::Vector2d kept = scales.kept_sd.cwiseAbs2();
  result.covariance += by_scales * kept.asDiagonal() * by_scales.transpose();
  check_halves(result, loops, places, along);
  finish(result, observations);
  tell_scales(result, loops, along, settings);
  tell_size_of_few(result, all, settings);
  tell_unseen(result, observations);
  tell_exchanged(result);
  if (!axis) tell_step(result, all, scales.estimate());
  result.size->estimate *= result.size_begun;
  result.size->sd *= result.size_begun;
  if (result.size->wanted) {
    result.size->wanted->estimate *= result.size_begun;
    result.size->wanted->sd *= result.size_begun;
  }
  restore_size(result);
  if (compared.size() < loops.size())
    result.warnings.push_back("other methods are compared on " + std::to_string(compared.size()) + " of " +
                              std::to_string(loops.size()) + " pairs, evenly spread");
  state_along(result);
  return result;
}

}  // namespace flash::calib
