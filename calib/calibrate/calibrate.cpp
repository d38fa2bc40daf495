#include "calib/calibrate/calibrate.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

#include "calib/calibrate/compare_methods.h"
#include "calib/calibrate/expect_convention.h"
#include "calib/calibrate/misfit_views.h"
#include "calib/calibrate/moving_rig.h"
#include "calib/calibrate/plausibility.h"
#include "calib/calibrate/stated_uncertainty.h"
#include "calib/geometry/projection.h"
#include "calib/solve/linearization.h"
#include "calib/uncertainty/lone_view.h"
#include "calib/uncertainty/pixel_fit.h"
#include "data/files/error.h"
#include "data/numbers/chi_square.h"
#include "data/numbers/median.h"

namespace flash::calib {
namespace {

constexpr double kDegree = M_PI / 180;

std::vector<Eigen::Isometry3d> target_poses(const std::vector<Observation>& observations) {
  std::vector<Eigen::Isometry3d> poses;
  poses.reserve(observations.size());
  for (const Observation& o : observations) poses.push_back(o.T_camera_target.front());
  return poses;
}

/// left_out: the views that were, with their reasons; one is named.
void expect_enough(std::size_t used, std::size_t all, int least, const std::string& left_out = {}) {
  if (used >= static_cast<std::size_t>(least)) return;
  throw data::InputError(std::to_string(used) + " of " + std::to_string(all) +
                         " views can be used: at least " + std::to_string(least) +
                         " are needed, and 12 or more for an answer to trust; add views" + left_out);
}

std::string first_left_out(const ViewSelection& selection) {
  for (std::size_t i = 0; i < selection.views.size(); ++i)
    if (!selection.views[i].used)
      return "; left out: " + selection.observations[i].image + ": " + selection.views[i].reason;
  return {};
}

/// The size with which views close, where it is to be solved for and they do not with that which is stated;
/// else 1. So many times as large is a unit.
double size_to_begin_with(const Calibration& result, const std::vector<Observation>& all,
                          const std::vector<Symmetry>& symmetries, const CalibrateSettings& settings) {
  constexpr double kUnit = 20;
  if (settings.size_as_stated || !settings.target_size_sd || std::isfinite(*settings.target_size_sd))
    return 1;
  const std::optional<Finding> sized =
      check_size(result.setup, all, symmetries, result.selection.robust_seed, settings.convention);
  return sized && sized->size < kUnit && sized->size * kUnit > 1 ? sized->size : 1;
}

/// As seen of a target that is so many times as large.
void resize(std::vector<Observation>& observations, double size) {
  for (Observation& observation : observations)
    for (Eigen::Isometry3d& T : observation.T_camera_target) T.translation() *= size;
}

/// The solution's bundle with the poses of the answer.
Bundle answer_of(const Calibration& result) {
  Bundle bundle = result.refined.bundle;
  if (bundle.cameras.empty()) return bundle;
  bundle.cameras.front() = result.poses.X;
  bundle.targets.front() = result.poses.Z;
  return bundle;
}

void report_views(Calibration& result) {
  result.views.resize(result.selection.views.size());
  for (std::size_t i = 0; i < result.views.size(); ++i) {
    result.views[i].used = result.selection.views[i].used;
    result.views[i].reason = result.selection.views[i].reason;
  }
  const Bundle &bundle = result.refined.bundle, answer = answer_of(result);
  for (const BundleView& view : bundle.views) {
    ViewResult& entry =
        result.views[static_cast<std::size_t>(result.used[static_cast<std::size_t>(view.pose)])];
    const auto rms = [&](bool corrected) {
      return std::sqrt(residuals(corrected ? bundle : answer, view, corrected).squaredNorm() /
                       static_cast<double>(view.points.cols()));
    };
    entry.px = rms(true);
    entry.chain_px = rms(false);
    entry.correction = motion_between(Eigen::Isometry3d::Identity(),
                                      bundle.poses[static_cast<std::size_t>(view.pose)].correction);
  }
}

/// Of the projected middle of the target against where the view's own pose puts it, by the lens as `stated`,
/// with which that pose was found, and of a target of that size over the stated one.
double centre_rms(const Bundle& bundle, const data::CameraIntrinsics& stated,
                  const std::vector<Eigen::Isometry3d>& T_camera_target, double size) {
  const IntrinsicsVector intrinsics = to_vector(bundle.intrinsics.front()), own = to_vector(stated);
  double sum = 0;
  for (const BundleView& view : bundle.views) {
    const Eigen::Vector3d centre = size * view.points.rowwise().mean();
    const Eigen::Vector3d true_centre = true_points(bundle, view).rowwise().mean();
    sum += (project(intrinsics, predicted_pose(bundle, view, false) * true_centre) -
            project(own, T_camera_target[static_cast<std::size_t>(view.pose)] * centre))
               .squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(bundle.views.size()));
}

/// The lens is taken as stated where it is one for all that the answer relates: what is wrong in it then
/// drops out. Each arm has a print of its own.
CalibrateSettings for_use(CalibrateSettings settings, const Eigen::Matrix3Xd& points) {
  if (!settings.target_size_sd) settings.target_size_sd = usual_size_sd(points);
  if (settings.use == Use::two_arms && settings.lens == LensKnowledge::near)
    settings.lens = LensKnowledge::stated;
  return settings;
}

Priors priors_of(const data::CameraIntrinsics& camera, const Eigen::Matrix3Xd& points,
                 const CalibrateSettings& settings) {
  Priors priors{.warp_sd = {usual_warp_sd(points)}};
  const double size_sd = *settings.target_size_sd;
  // A size that is kept is none of the unknowns, but of what is judged beside it: it may be off by any share.
  constexpr double kAny = 0.3;
  if (size_sd == 0 || settings.size_as_stated)
    priors.scale_sd = {kAny};
  else if (std::isfinite(size_sd))
    priors.scale_sd = {size_sd};
  if (settings.lens == LensKnowledge::near) priors.lenses = {lens_prior(camera, settings.lens_covariance)};
  return priors;
}

/// Errors in variables again and again, without the view that no longer looks like the rest, until all do.
/// Returns the bundle at its seed.
Bundle refine_and_drop(Calibration& result, std::vector<Observation>& observations,
                       const data::CameraIntrinsics& camera, const Eigen::Matrix3Xd& points,
                       const RefineSettings& refine_settings, const CalibrateSettings& settings) {
  for (bool dropping = true;;) {
    const std::vector<PoseLoop> loops = pose_loops(result.setup, observations);
    const HandEyePoses seed = better_of(loops, shah(loops), result.selection.robust_seed.poses);
    Bundle plain = make_bundle(result.setup, camera, points, observations, seed);
    plain.priors = priors_of(camera, points, settings);
    plain.scales = {result.size_begun};
    if (const std::optional<OneAxis> axis = axis_of(result.setup, observations, settings))
      plain.priors.along = loose_along(*axis, seed, usual_distance(observations));
    result.refined = refine(plain, refine_settings);
    const bool few = observations.size() <= static_cast<std::size_t>(settings.least_views);
    if (dropping && !few && drop_worst(result, observations, settings.surprise)) continue;
    dropping = false;
    if (!readmit(result, observations, points, refine_settings.bundle)) return plain;
  }
}

/// Of a robot that turns about one axis: a place along it that turns do not tell is held from here on.
void settle_place(Calibration& result, const std::vector<Observation>& observations, Bundle& plain,
                  const RefineSettings& refine_settings, const CalibrateSettings& settings) {
  const std::optional<OneAxis> axis = axis_of(result.setup, observations, settings);
  if (!axis) return;
  Bundle& bundle = result.refined.bundle;
  const double distance = usual_distance(observations);
  // The robot's errors may turn about any place between gripper and target.
  const SettledPlace settled =
      settle_along(*axis, *bundle.priors.along, {bundle.cameras.front(), bundle.targets.front()},
                   result.refined.covariance.topLeftCorner<6, 6>(), result.refined.noise.rotation.front(),
                   0.5 * distance, distance, settings.height);
  result.along = settled.place;
  if (!settled.hold) return;
  for (Bundle* held : {&plain, &bundle}) {
    const HandEyePoses poses = moved_to(*settled.hold, *axis, {held->cameras.front(), held->targets.front()});
    held->cameras.front() = poses.X;
    held->targets.front() = poses.Z;
    held->priors.along = settled.hold;
  }
  result.refined = refine(std::move(bundle), refine_settings);
}

/// Where an answer is none although most views close: the reading that explains them, if there is one.
std::optional<std::string> cause_of(const Calibration& result, const std::vector<Observation>& all,
                                    const std::vector<Symmetry>& symmetries,
                                    const CalibrateSettings& settings) {
  ConventionSettings any = settings.convention;
  any.suspicious = 0;
  const RobustSeed& stated = result.selection.robust_seed;
  std::optional<Finding> finding =
      check_convention(result.setup, all, symmetries, stated, settings.angles, any);
  if (!finding) finding = check_size(result.setup, all, symmetries, stated, any);
  if (!finding) return std::nullopt;
  return finding->sentence;
}

/// Of the lens and the target, which are not what was stated.
void warn_of_shapes(Calibration& result, bool disputed, const CalibrateSettings& settings) {
  if (result.edges && result.edges->far_off()) tell_first(result, edge_sentence(*result.edges));
  if (result.warp.far_off()) tell_first(result, warp_sentence(result.warp));
  if (!result.lens.far_off.empty()) tell_first(result, lens_sentence(result.lens));
  if (!result.size || !result.size->far_off()) return;
  // Who states a size that is to be kept is told, and served.
  tell_first(result, size_sentence(*result.size), disputed && !settings.size_as_stated);
}

/// How the camera moves, right perturbation, where the lens is kept as it is stated and noise is estimated
/// anew.
Vector6d shift_with_stated_lens(const Calibration& result, Bundle plain, RefineSettings refine_settings,
                                const data::CameraIntrinsics& camera) {
  refine_settings.bundle.unknowns.intrinsics = 0;
  plain.priors.lenses.clear();
  plain.intrinsics = {camera};
  const Refinement refined = refine(std::move(plain), refine_settings);
  return motion_between(result.poses.X, refined.bundle.cameras.front());
}

/// A lens that is stated to the last digit, against one that is near to it: pictures that want another one
/// say so, and an answer that depends on it is none.
void check_stated_lens(Calibration& result, Bundle plain, RefineSettings refine_settings,
                       const data::CameraIntrinsics& camera, const LensCovariance& stated) {
  refine_settings.bundle.unknowns.intrinsics = kLensUnknowns;
  plain.priors.lenses = {lens_prior(camera, stated)};
  const Refinement refined = refine(std::move(plain), refine_settings);
  const LensEstimate lens =
      lens_estimate(refined.bundle, refine_settings.bundle.unknowns, refined.covariance);
  if (lens.far_off.empty()) return;
  const Vector6d away = motion_between(result.poses.X, refined.bundle.cameras.front());
  const bool depends = away.dot(result.covariance.ldlt().solve(away)) > data::chi_square_999_of_6;
  char text[200];
  std::snprintf(text, sizeof text,
                "; with it the camera is %.1f mm and %.2f deg from where it is here: leave --lens stated out",
                1e3 * away.head<3>().norm(), away.tail<3>().norm() / kDegree);
  tell_first(result, lens_differs(lens) + text, depends);
}

/// An answer for arms that share a lens keeps it as it is stated. What the lens may be off drops out between
/// the arms, but not of where the camera is.
void add_shared_lens(Calibration& result, Bundle plain, RefineSettings refine_settings,
                     const data::CameraIntrinsics& camera, const LensCovariance& stated) {
  refine_settings.bundle.unknowns.intrinsics = kLensUnknowns;
  plain.priors.lenses = {lens_prior(camera, stated)};
  const Refinement refined = refine(std::move(plain), refine_settings);
  const Vector6d away = motion_between(result.poses.X, refined.bundle.cameras.front());
  const Matrix6d more = refined.covariance.topLeftCorner<6, 6>() - result.repeatable;
  const Eigen::SelfAdjointEigenSolver<Matrix6d> eigen(more);
  result.covariance += eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0.0).asDiagonal() *
                           eigen.eigenvectors().transpose() +
                       away * away.transpose();
  const LensEstimate lens =
      lens_estimate(refined.bundle, refine_settings.bundle.unknowns, refined.covariance);
  if (lens.far_off.empty()) return;
  char text[200];
  std::snprintf(
      text, sizeof text,
      "; it was kept, as arms on one camera share it, and the camera is %.1f mm and %.2f deg from where "
      "it is with the other: calibrate the lens",
      1e3 * away.head<3>().norm(), away.tail<3>().norm() / kDegree);
  tell_first(result, lens_differs(lens) + text);
}

/// A view that the answer hangs on is told: if it is wrong, nothing shows it.
void warn_of_lone_view(Calibration& result, const BundleSettings& settings, double distance) {
  const std::optional<LoneView> lone = lone_view(result.refined, settings);
  if (!lone) return;
  const auto view = static_cast<std::size_t>(result.used[lone->pose]);
  char text[320];
  std::snprintf(text, sizeof text,
                "the answer hangs on %s: without it the %s would be known %.0f times worse, and if its "
                "pose is wrong, nothing shows it; add views like it",
                result.selection.observations[view].image.c_str(),
                weakest_direction(lone->covariance, distance, "camera").name.c_str(), lone->growth);
  result.warnings.emplace_back(text);
}

void warn(Calibration& result) {
  std::size_t missing = 0;
  for (const ViewResult& view : result.views) missing += view.used ? 0 : 1;
  if (result.used.size() < 10)
    result.warnings.push_back(
        std::to_string(result.used.size()) +
        " views: noise levels and uncertainty are themselves uncertain; 15 or more are better");
  constexpr double kWideTurn = 10;  // [deg]
  const double second = result.diversity.spread.y() / kDegree;
  const bool settled = result.along && (!result.along->told || result.along->measured);
  if (second < kWideTurn && !settled) {
    char text[240];
    std::snprintf(
        text, sizeof text,
        "the gripper turned by no more than %.1f deg rms about its second axis: turns by 20 to 40 deg about "
        "two axes are what tells the camera's place",
        second);
    result.warnings.emplace_back(text);
  }
  if (missing > 0) {
    std::string sentence = std::to_string(missing) + " of " + std::to_string(result.views.size()) +
                           (missing == 1 ? " views was not used" : " views were not used");
    const std::string misfits = misfit_sentence(result.selection);
    result.warnings.push_back(misfits.empty() ? sentence : sentence + ": " + misfits);
  }
  if (result.selection.renumbered > 0)
    result.warnings.push_back(std::to_string(result.selection.renumbered) +
                              " views had the target numbered from its other end; put right");
  bool unusable = false;
  const std::string noisy = has_pixels(result) ? unusual_noise(result.refined.noise, unusable)
                                               : unusual_scatter(result.refined.noise);
  // Noise that a size makes which is to be kept is that size's.
  const bool of_size = result.size && result.size->prior_sd == 0 && result.size->far_off();
  if (!noisy.empty()) tell_first(result, noisy, unusable && !of_size);
  if (!result.refined.converged) tell_first(result, "the refinement did not converge", true);
}

}  // namespace

void tell_first(Calibration& calibration, std::string sentence, bool refuses) {
  if (refuses) {
    calibration.usable = false;
    calibration.refusals.insert(calibration.refusals.begin(), sentence);
    sentence += "; the answer cannot be used";
  }
  calibration.warnings.insert(calibration.warnings.begin(), std::move(sentence));
}

bool has_pixels(const Calibration& calibration) { return !calibration.refined.bundle.cameras.empty(); }

std::vector<Observation> prepare(Calibration& result, const std::vector<Observation>& all,
                                 const std::vector<Symmetry>& symmetries, const CalibrateSettings& settings) {
  std::vector<Eigen::Isometry3d> reported;
  for (const Observation& observation : all)
    if (!observation.T_camera_target.empty()) reported.push_back(observation.T_base_gripper);
  expect_enough(reported.size(), all.size(), settings.least_views);
  expect_motion(reported);
  const std::string reason = degeneracy(rotation_diversity(reported));
  if (!reason.empty()) throw data::InputError(reason);
  result.selection = select_views(result.setup, all, symmetries, settings.selection);
  std::vector<Observation> sized = all;
  result.size_begun = size_to_begin_with(result, all, symmetries, settings);
  if (result.size_begun != 1) {
    resize(sized, result.size_begun);
    result.selection = select_views(result.setup, sized, symmetries, settings.selection);
  }
  expect_convention(result.setup, sized, symmetries, result.selection.robust_seed, settings);
  std::vector<Observation> observations = used_observations(result.selection, &result.used);
  expect_enough(observations.size(), all.size(), settings.least_views, first_left_out(result.selection));
  return observations;
}

double usual_distance(const std::vector<Observation>& observations) {
  std::vector<double> distances;
  distances.reserve(observations.size());
  for (const Observation& o : observations)
    distances.push_back(o.T_camera_target.front().translation().norm());
  return data::median(distances);
}

std::optional<OneAxis> axis_of(Setup setup, const std::vector<Observation>& used,
                               const CalibrateSettings& settings) {
  std::vector<Eigen::Isometry3d> robot;
  robot.reserve(used.size());
  for (const Observation& observation : used) robot.push_back(observation.T_base_gripper);
  std::optional<OneAxis> axis = one_axis(setup, robot);
  if (!axis && settings.height)
    throw data::InputError(
        std::string(settings.height->target ? "--target-height" : "--camera-height") +
        ": the robot turns about more than one axis, which tells that height: leave it out");
  return axis;
}

void state_along(Calibration& result) {
  if (!result.along) return;
  const Matrix6d along = covariance_along(*result.along, result.poses.X);
  result.covariance += along;
  result.repeatable += along;
  if (!result.along->told) tell_first(result, untold_sentence(*result.along, result.setup));
}

void restore_size(Calibration& result) {
  if (result.size_begun != 1) resize(result.selection.observations, 1 / result.size_begun);
}

bool finish(Calibration& result, const std::vector<Observation>& used) {
  report_views(result);
  std::vector<Eigen::Isometry3d> robot;
  robot.reserve(used.size());
  for (const Observation& observation : used) robot.push_back(observation.T_base_gripper);
  result.diversity = rotation_diversity(robot);
  result.weakest = weakest_direction(result.covariance, usual_distance(used), "camera");
  warn(result);
  const std::string implausible = implausibility(result, used);
  if (implausible.empty()) return true;
  tell_first(result, implausible, true);
  return false;
}

namespace {

/// With whatever moved taken to have stood still.
Calibration solve(Setup setup, const data::CameraIntrinsics& camera, const Eigen::Matrix3Xd& points,
                  const std::vector<Symmetry>& symmetries, const std::vector<Observation>& all,
                  const CalibrateSettings& given) {
  const CalibrateSettings settings = for_use(given, points);
  Calibration result;
  result.setup = setup;
  std::vector<Observation> observations = prepare(result, all, symmetries, settings);

  RefineSettings refine_settings = settings.refine;
  refine_settings.bundle.unknowns.scales = *settings.target_size_sd > 0 && !settings.size_as_stated;
  refine_settings.bundle.unknowns.warps = refine_settings.bundle.unknowns.edge_offsets = true;
  refine_settings.bundle.unknowns.intrinsics = settings.lens == LensKnowledge::stated ? 0 : kLensUnknowns;
  refine_settings.bundle.unknowns.joint_errors = observations.front().joint_motions.cols() > 0;
  result.unknowns = refine_settings.bundle.unknowns;
  Bundle plain = refine_and_drop(result, observations, camera, points, refine_settings, settings);
  const std::string noisy = implausible_noise(result.refined.noise, observations);
  if (!noisy.empty()) throw data::InputError(cause_of(result, all, symmetries, settings).value_or(noisy));
  settle_place(result, observations, plain, refine_settings, settings);
  SizedRefinement sized = refine_sizes(std::move(result.refined), refine_settings, result.size_begun);
  result.refined = std::move(sized.refined);
  result.size = sized.sizes.front();
  if (std::isinf(*settings.target_size_sd) && !result.size->wanted)
    throw data::InputError(
        "the data do not tell the size of the target: the robot moves too little; leave --target-size solved "
        "out, or add views farther apart");
  BundleSettings exact_robot = settings.refine.bundle;
  exact_robot.unknowns.corrections = false;
  exact_robot.huber = 0;
  solve_bundle(plain, result.refined.noise, exact_robot);

  const Bundle& bundle = result.refined.bundle;
  std::optional<PixelFit> pixels;
  if (settings.use == Use::image && !result.unknowns.joint_errors && !result.along)
    pixels = fit_pixels(result.refined, refine_settings.bundle,
                        fit_pose_errors(result.refined, refine_settings.bundle));
  compare_methods(result, observations, plain, pixels, refine_settings, settings);
  result.poses = result.comparison.back().poses;
  result.corner_rms = reprojection_rms(bundle, true);
  result.chain_rms = result.comparison.back().px;
  result.centre_rms = centre_rms(answer_of(result), camera, target_poses(observations), result.size_begun);
  const double smooth = add_uncertainty(result, sized.systematic, refine_settings.bundle);
  if (result.method == Method::pixels) {
    result.covariance = pixels->covariance;
    result.repeatable = pixels->repeatable;
  }
  result.lens = lens_estimate(bundle, result.unknowns, result.shared_covariance);
  result.lens.stated = to_vector(camera);
  result.warp = warp_estimate(bundle, result.unknowns, result.shared_covariance);
  result.edges = edge_estimate(bundle, result.unknowns, result.shared_covariance);
  if (settings.lens != given.lens)
    add_shared_lens(result, plain, refine_settings, camera, settings.lens_covariance);
  check_parts(result, smooth, refine_settings.bundle, settings);
  warn_of_lone_view(result, refine_settings.bundle, usual_distance(observations));
  const bool plausible = finish(result, observations);
  // Who keeps a size is answered, however far off it may be.
  if (settings.size_as_stated || result.unknowns.scales) {
    result.covariance +=
        (settings.size_as_stated
             ? covariance_of_kept_sizes(result.refined, refine_settings.bundle, sized.sizes,
                                        {*settings.target_size_sd})
             : covariance_of_disputed_sizes(result.refined, refine_settings.bundle, sized.sizes))
            .topLeftCorner<6, 6>();
    result.weakest = weakest_direction(result.covariance, usual_distance(observations), "camera");
  }
  if (settings.lens != LensKnowledge::stated)
    result.lens.camera_shift = shift_with_stated_lens(result, plain, refine_settings, camera);
  if (given.lens == LensKnowledge::stated)
    check_stated_lens(result, std::move(plain), refine_settings, camera, settings.lens_covariance);
  warn_of_shapes(result, sized.disputed, settings);
  if (!plausible)
    if (const auto cause = cause_of(result, all, symmetries, settings)) tell_first(result, *cause, true);
  restore_size(result);
  state_along(result);
  return result;
}

}  // namespace

Calibration calibrate(Setup setup, const data::CameraIntrinsics& camera, const Eigen::Matrix3Xd& points,
                      const std::vector<Symmetry>& symmetries, const std::vector<Observation>& all,
                      const CalibrateSettings& settings) {
  const StillSolver solver = [&](const std::vector<Observation>& views) {
    return solve(setup, camera, points, symmetries, views, settings);
  };
  return settings.motions ? calibrate_moving(all, points, solver) : solver(all);
}

}  // namespace flash::calib
