#include "calib/calibrate/calibrate_pairs.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "calib/solve/pose_space.h"

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

/// Halves of the pairs in time and by the gripper's places, each solved by itself: where they put the camera
/// must agree, and in time the target too. Else something moved meanwhile, or the robot errs by its pose.
void check_halves(Calibration& result, const std::vector<PoseLoop>& loops,
                  const std::vector<Eigen::Vector3d>& places) {
  constexpr std::size_t kEnough = 16;
  if (loops.size() < kEnough) return;
  std::vector<SplitCheck> checks;
  for (const Split split : {Split::consecutive, Split::place_1, Split::place_2, Split::place_3}) {
    const std::vector<int> half = halves_of(places, split);
    std::vector<PoseLoop> parts[2];
    for (std::size_t i = 0; i < loops.size(); ++i) parts[half[i]].push_back(loops[i]);
    PoseSpaceFit fits[2];
    for (int k = 0; k < 2; ++k)
      fits[k] = fit_pose_space(parts[k], better_of(parts[k], shah(parts[k]), result.poses));
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
  result.covariance *= result.covariance_factor;
  result.repeatable = result.covariance;
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

}  // namespace

Calibration calibrate_pairs(Setup setup, const std::vector<Observation>& all,
                            const CalibrateSettings& settings) {
  Calibration result;
  result.setup = setup;
  const std::vector<Observation> observations = prepare(result, all, {Symmetry{}}, settings);
  const std::vector<PoseLoop> loops = pose_loops(setup, observations);
  // Half turns about three axes leave Shah's equations several solutions.
  const PoseSpaceFit fit =
      fit_pose_space(loops, better_of(loops, shah(loops), result.selection.robust_seed.poses));
  result.poses = fit.poses;
  result.covariance = result.repeatable = fit.covariance.topLeftCorner<6, 6>();
  result.refined.noise = {{0.0}, {fit.rotation}, {fit.translation}, {0.0}};
  result.refined.converged = fit.converged;
  const std::vector<PoseLoop> compared = thinned(loops);
  result.comparison = compare_closed_forms(compared, settings.closed_forms);
  for (ComparedMethod& method : result.comparison) {
    if (method.name == "park") method.held_out = hold_out_pairs(compared, settings.folds, park);
    if (method.name == "shah") method.held_out = hold_out_pairs(compared, settings.folds, shah);
  }
  result.held_out = hold_out_pairs(loops, settings.folds, [&fit](const std::vector<PoseLoop>& train) {
    return fit_pose_space(train, better_of(train, shah(train), fit.poses)).poses;
  });
  result.use = use_error(Use::workspace, result.held_out, std::nullopt);
  result.comparison.push_back({.name = "pose_space",
                               .poses = fit.poses,
                               .relative = relative_rms(compared, fit.poses.X),
                               .held_out = result.held_out});
  std::vector<Eigen::Vector3d> places;
  for (const Observation& observation : observations)
    places.push_back(observation.T_base_gripper.translation());
  check_halves(result, loops, places);
  finish(result, observations);
  result.warnings.emplace_back(
      "pairs of poses tell the scatter alone: what the errors of an arm's model have in common is not in the "
      "stated standard deviations; pictures tell of it");
  if (compared.size() < loops.size())
    result.warnings.push_back("other methods are compared on " + std::to_string(compared.size()) + " of " +
                              std::to_string(loops.size()) + " pairs, evenly spread");
  return result;
}

}  // namespace flash::calib
