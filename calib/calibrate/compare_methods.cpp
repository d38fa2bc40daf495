#include "calib/calibrate/compare_methods.h"

#include <limits>

namespace flash::calib {
namespace {

std::vector<Eigen::Isometry3d> target_poses(const std::vector<Observation>& observations) {
  std::vector<Eigen::Isometry3d> poses;
  poses.reserve(observations.size());
  for (const Observation& o : observations) poses.push_back(o.T_camera_target.front());
  return poses;
}

/// A method can close A X = X B as well as others and still be far off in a direction that motions hardly
/// show: then the target lies elsewhere in the pictures.
void flag_wild_pixels(std::vector<ComparedMethod>& closed_forms) {
  constexpr double kWild = 10;
  double least = std::numeric_limits<double>::infinity();
  for (const ComparedMethod& method : closed_forms)
    if (!method.wild && method.px < least) least = method.px;
  for (ComparedMethod& method : closed_forms)
    method.wild = method.wild || !(method.px <= kWild * least + 1e-3);
}

/// Middle of where the target was seen, in the parent of X.
Eigen::Vector3d workspace_middle(const Bundle& bundle) {
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const BundleView& view : bundle.views)
    middle += bundle.cameras.front() * (predicted_pose(bundle, view) * view.points.rowwise().mean());
  return middle / static_cast<double>(bundle.views.size());
}

/// Fewer pixels in the parts that were left out, by more than two standard errors of the difference.
bool predicts_better(const HeldOut& held, const HeldOut& other) {
  const MeanDifference more = mean_difference(means_of_folds(other, 0), means_of_folds(held, 0));
  return more.mean > 2 * more.sd;
}

}  // namespace

void compare_methods(Calibration& result, const std::vector<Observation>& observations, const Bundle& plain,
                     const std::optional<PixelFit>& pixels, RefineSettings settings,
                     const CalibrateSettings& calibrate) {
  const std::vector<PoseLoop> loops = pose_loops(result.setup, observations);
  const std::vector<Eigen::Isometry3d> poses = target_poses(observations);
  const Bundle& refined = result.refined.bundle;
  const Eigen::Vector3d middle = workspace_middle(refined);
  Bundle bundle = plain;
  settings.noise = result.refined.noise;
  // Halves of one recording show one print.
  RefineSettings of_halves = settings;
  of_halves.bundle.unknowns.scales = of_halves.bundle.unknowns.warps = false;
  const auto hold = [&](Method method, ComparedMethod& entry) {
    const bool corrected = method == Method::errors_in_variables || method == Method::pixels;
    const Bundle& start = corrected ? refined : plain;
    entry.held_out =
        hold_out(start, poses, method, settings, calibrate.folds, calibrate.threads, calibrate.held_out_seed);
    if (calibrate.use == Use::two_arms && loops.size() >= 4 * static_cast<std::size_t>(calibrate.least_views))
      entry.halves =
          halves_apart(start, poses, method, of_halves, middle, calibrate.folds, calibrate.threads);
  };
  result.comparison = compare_closed_forms(loops, calibrate.closed_forms);
  for (ComparedMethod& method : result.comparison) {
    bundle.cameras.front() = method.poses.X;
    bundle.targets.front() = method.poses.Z;
    method.px = reprojection_rms(bundle, false);
    if (method.name == "park") hold(Method::park, method);
    if (method.name == "shah") hold(Method::shah, method);
  }
  flag_wild_pixels(result.comparison);
  const auto add = [&](Method kind, Bundle solved) {
    ComparedMethod& method = result.comparison.emplace_back();
    method.name = to_string(kind);
    if (kind == Method::pixels) {
      solved.cameras.front() = pixels->poses.X;
      solved.targets.front() = pixels->poses.Z;
    }
    method.poses = {solved.cameras.front(), solved.targets.front()};
    method.relative = relative_rms(loops, method.poses.X);
    method.px = reprojection_rms(solved, false);
    hold(kind, method);
  };
  add(Method::bundle, plain);
  if (pixels) add(Method::pixels, refined);
  add(Method::errors_in_variables, refined);
  ComparedMethod* const last = &result.comparison.back();
  if (pixels && predicts_better(*last[-1].held_out, *last->held_out)) {
    std::swap(last[-1], *last);
    result.method = Method::pixels;
  }
  result.held_out = *last->held_out;
  result.use = use_error(calibrate.use, result.held_out, last->halves);
}

}  // namespace flash::calib
