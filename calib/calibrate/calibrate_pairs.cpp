#include "calib/calibrate/calibrate_pairs.h"

#include <algorithm>
#include <cmath>

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
  finish(result, observations);
  if (compared.size() < loops.size())
    result.warnings.push_back("other methods are compared on " + std::to_string(compared.size()) + " of " +
                              std::to_string(loops.size()) + " pairs, evenly spread");
  return result;
}

}  // namespace flash::calib
