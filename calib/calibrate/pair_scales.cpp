#include "calib/calibrate/pair_scales.h"

#include <Eigen/Cholesky>
#include <cmath>
#include <cstdio>
#include <limits>

#include "calib/calibrate/stated_uncertainty.h"
#include "calib/solve/convention_check.h"
#include "calib/solve/lens_prior.h"
#include "calib/uncertainty/split_check.h"
#include "data/files/error.h"
#include "data/numbers/chi_square.h"

namespace flash::calib {
namespace {

constexpr double kUsualSize = 0.01;    // standard deviation of what a size that is stated is off by
constexpr double kUsualFocal = 0.005;  // of a focal length, as usual_lens_prior() has it
constexpr double kUnknown = 0.1;       // a scale that is known to less is not told
constexpr std::size_t kEnough = 8;     // pairs of which halves tell something

double focal_length_sd(const CalibrateSettings& settings) {
  switch (settings.lens) {
    case LensKnowledge::stated:
      return 0;
    case LensKnowledge::near:
      return kUsualFocal;
    case LensKnowledge::unknown:
      return std::numeric_limits<double>::infinity();
  }
  return kUsualFocal;
}

/// An answer for arms that share a lens keeps it, as of pictures; what it may be off counts.
bool keeps_shared_lens(const CalibrateSettings& settings) {
  return settings.use == Use::two_arms && settings.lens == LensKnowledge::near;
}

/// What pairs want, and the covariance of its logs.
struct Wanted {
  SeenScales scales;
  Eigen::Matrix2d covariance;
};

/// Of two answers that are as far apart, and as good: the variance about their middle.
void add_apart(const Eigen::Vector2d& apart, double share, Eigen::Matrix2d& sum) {
  sum += 0.25 * share * apart * apart.transpose();
}

/// What the halves of the robot's places do not agree on.
Eigen::Matrix2d apart_by_halves(const std::vector<PoseLoop>& loops,
                                const std::vector<Observation>& observations, const PoseSpaceFit& fit,
                                const std::optional<AlongPrior>& along, const ScalesUnknown& known) {
  std::vector<Eigen::Vector3d> places;
  for (const Observation& observation : observations)
    places.push_back(observation.T_base_gripper.translation());
  Eigen::Matrix2d apart = Eigen::Matrix2d::Zero();
  constexpr Split kSplits[] = {Split::consecutive, Split::place_1, Split::place_2, Split::place_3};
  for (const Split split : kSplits) {
    const std::vector<int> half = halves_of(places, split);
    std::vector<PoseLoop> parts[2];
    for (std::size_t i = 0; i < loops.size(); ++i) parts[half[i]].push_back(loops[i]);
    add_apart(fit_pose_space(parts[0], fit.poses, known, along).scales.logs() -
                  fit_pose_space(parts[1], fit.poses, known, along).scales.logs(),
              1.0 / static_cast<double>(std::size(kSplits)), apart);
  }
  return apart;
}

/// With what the halves of the robot's places do not agree on, which none of them sees by itself, and with
/// whose the noise is. None where the solution does not converge.
std::optional<Wanted> wanted_scales(const std::vector<PoseLoop>& loops,
                                    const std::vector<Observation>& observations, const HandEyePoses& seed,
                                    const std::optional<AlongPrior>& along, const ScalesUnknown& known) {
  const PoseSpaceFit fit = fit_pose_space(loops, seed, known, along);
  if (!fit.converged) return std::nullopt;
  Wanted wanted{fit.scales, fit.covariance.bottomRightCorner<2, 2>()};
  // Few pairs tell their noise worse than a scale: at three deviations Student's t, of as many degrees of
  // freedom as are left, is as much longer (Abramowitz and Stegun 26.7.5).
  const auto left = static_cast<double>(6 * loops.size() - 14);
  wanted.covariance *= std::pow(1 + 2.5 / left, 2);
  if (loops.size() >= kEnough)
    raise_to(apart_by_halves(loops, observations, fit, along, known), wanted.covariance);
  const auto with_noise_of = [&](double camera_share) {
    ScalesUnknown of = known;
    of.camera_share = camera_share;
    return fit_pose_space(loops, seed, of, along).scales.logs();
  };
  add_apart(with_noise_of(1) - with_noise_of(0), 1, wanted.covariance);
  return wanted;
}

/// A scale that is told by itself, of its logarithm's deviation.
std::optional<TargetSize::Wanted> told(const std::optional<Wanted>& wanted, double SeenScales::*scale,
                                       Eigen::Index i) {
  const double sd = wanted ? std::sqrt(wanted->covariance(i, i)) : kUnknown;
  if (!(sd < kUnknown)) return std::nullopt;
  return TargetSize::Wanted{(*wanted).scales.*scale, (*wanted).scales.*scale * sd};
}

/// What was known of a number before, where it is found to be `log`: it has a long tail.
double known_variance(double prior_sd, double log) { return prior_sd * prior_sd + log * log / kLensTail; }

/// With one number known beforehand, about 0.
void take_in(double prior_sd, Eigen::Index i, Eigen::Vector2d& logs, Eigen::Matrix2d& covariance) {
  if (!std::isfinite(prior_sd)) return;
  const Eigen::Vector2d found = logs;
  const double variance = covariance(i, i);
  double known = known_variance(prior_sd, logs[i]);
  constexpr int kTimes = 50;  // by which the tail has settled
  for (int time = 0; time < kTimes; ++time)
    known = known_variance(prior_sd, found[i] * known / (variance + known));
  const Eigen::Vector2d gain = covariance.col(i) / (variance + known);
  const Eigen::RowVector2d row = covariance.row(i);
  logs -= gain * found[i];
  covariance -= gain * row;
}

/// Of the answer with other scales than those it is for.
Vector6d camera_with(const Calibration& result, const std::vector<PoseLoop>& loops,
                     const std::optional<AlongPrior>& along, const SeenScales& over) {
  return motion_between(result.poses.X,
                        fit_pose_space(rescaled(loops, over), result.poses, {}, along).poses.X);
}

/// Whether an answer that far away lies outside of what is stated. What was stated as exact is only
/// contradicted by what cannot be chance: an arm whose links are off looks like another size, and its errors
/// are in the covariance.
bool excluded(const Calibration& result, const Vector6d& away, bool stated_as_exact = false) {
  return away.dot(result.covariance.ldlt().solve(away)) >
         (stated_as_exact ? data::chi_square_999_of_6 : data::chi_square_95_of_6);
}

void tell_size(Calibration& result, const std::vector<PoseLoop>& loops,
               const std::optional<AlongPrior>& along, const CalibrateSettings& settings) {
  const TargetSize& size = *result.size;
  if (!size.far_off()) return;
  const Vector6d away = camera_with(result, loops, along, {.size = size.wanted->estimate / size.estimate}),
                 as_stated = camera_with(result, loops, along, {.size = 1 / size.estimate});
  const bool exact = size.prior_sd == 0,
             depends = excluded(result, away, exact) || excluded(result, as_stated, exact);
  if (settings.size_as_stated) result.covariance += away * away.transpose();
  const Vector6d& farther = as_stated.head<3>().norm() > away.head<3>().norm() ? as_stated : away;
  constexpr double kOfLinks = 0.03;  // what an arm's links may make of a length
  char text[400];
  std::snprintf(
      text, sizeof text,
      "the target is %.4g times as large as stated (+- %.2g, 2 sd), or the robot's %s: measure a square; the "
      "answer is for %.4g, and with the stated or the other size the camera is up to %.1f mm and %.2f deg "
      "from "
      "where it is here (--target-size solved takes the estimate)",
      size.wanted->estimate, 2 * size.wanted->sd,
      std::abs(size.wanted->estimate - 1) < kOfLinks ? "lengths are off by as much"
                                                     : "translations are not in metres",
      size.estimate, 1e3 * farther.head<3>().norm(), farther.tail<3>().norm() * 180 / M_PI);
  tell_first(result, text, depends && !settings.size_as_stated);
}

/// One that was kept as it is stated, where the pairs want another.
void tell_kept_focal_length(Calibration& result, const Vector6d& away, const CalibrateSettings& settings) {
  const TargetSize::Wanted& wanted = *result.focal_length->wanted;
  const bool shared = keeps_shared_lens(settings), depends = excluded(result, away, true);
  char text[400];
  std::snprintf(text, sizeof text,
                "the camera's focal length is %.4g times (+- %.2g, 2 sd) that with which the target's poses "
                "were made; the stated one was kept%s, and with the other the camera is %.1f mm and %.2f deg "
                "from where it is here: %s",
                wanted.estimate, 2 * wanted.sd, shared ? ", as arms on one camera share it" : "",
                1e3 * away.head<3>().norm(), away.tail<3>().norm() * 180 / M_PI,
                shared ? "calibrate the lens and make the poses anew" : "leave --lens stated out");
  if (shared) result.covariance += away * away.transpose();
  tell_first(result, text, depends && !shared);
}

void tell_focal_length(Calibration& result, const std::vector<PoseLoop>& loops,
                       const std::optional<AlongPrior>& along, const CalibrateSettings& settings) {
  if (!result.focal_length) return;
  const TargetSize& focal = *result.focal_length;
  if (settings.lens == LensKnowledge::unknown && !focal.wanted) {
    char text[200];
    std::snprintf(
        text, sizeof text,
        "the pairs do not tell the camera's focal length: the answer counts it as known to %.0f %%; add "
        "views, or leave --lens solved out",
        100 * focal.prior_sd);
    tell_first(result, text);
  }
  if (!focal.far_off()) return;
  const Vector6d away =
      camera_with(result, loops, along, {.focal_length = focal.wanted->estimate / focal.estimate});
  if (focal.sd == 0) return tell_kept_focal_length(result, away, settings);
  const Vector6d as_stated = camera_with(result, loops, along, {.focal_length = 1 / focal.estimate});
  char text[400];
  std::snprintf(
      text, sizeof text,
      "the camera's focal length is %.4g times (+- %.2g, 2 sd) that with which the target's poses were made: "
      "calibrate the lens and make them anew, or give the pictures; the answer is for %.4g, and with the "
      "stated focal length the camera is %.1f mm and %.2f deg from where it is here",
      focal.wanted->estimate, 2 * focal.wanted->sd, focal.estimate, 1e3 * as_stated.head<3>().norm(),
      as_stated.tail<3>().norm() * 180 / M_PI);
  tell_first(result, text, excluded(result, away));
}

}  // namespace

SeenScales PairScales::estimate() const { return {size.estimate, focal_length ? focal_length->estimate : 1}; }

PairScales settle_scales(std::vector<PoseLoop>& loops, const std::vector<Observation>& observations,
                         const HandEyePoses& seed, const std::optional<AlongPrior>& along,
                         const CalibrateSettings& settings) {
  PairScales scales{.size = {.prior_sd = settings.target_size_sd.value_or(kUsualSize)}};
  TargetSize& size = scales.size;
  const double unknown = std::numeric_limits<double>::infinity();
  const bool seen = !unseen_targets(observations).plainly();  // a tracker's poses are seen along no axis
  const auto wanted = [&](double size_sd, double focal_sd) {
    return wanted_scales(loops, observations, seed, along, {.size_sd = size_sd, .focal_length_sd = focal_sd});
  };
  TargetSize focal{.prior_sd = seen ? focal_length_sd(settings) : 0};
  if (seen) focal.wanted = told(wanted(unknown, unknown), &SeenScales::focal_length, 1);
  if (std::isinf(focal.prior_sd) && !focal.wanted) focal.prior_sd = kUnknown;
  const bool focal_kept = keeps_shared_lens(settings), focal_solved = focal.prior_sd > 0 && !focal_kept;
  const double focal_sd = focal_solved ? focal.prior_sd : 0;
  const std::optional<Wanted> any_size = wanted(unknown, focal_sd);
  size.wanted = told(any_size, &SeenScales::size, 0);
  if (std::isinf(size.prior_sd) && !size.wanted)
    throw data::InputError(
        "the data do not tell the size of the target: the robot moves too little; leave --target-size solved "
        "out, or add views farther apart");
  const bool solved = size.prior_sd > 0 && !settings.size_as_stated;
  if (settings.size_as_stated && std::isfinite(size.prior_sd)) scales.kept_sd[0] = size.prior_sd;
  if (focal_kept) scales.kept_sd[1] = focal.prior_sd;
  // Of pairs that do not tell a size, what is known weighs as much as they do. A size that is kept does not
  // bend the focal length.
  const bool by_pairs = size.wanted.has_value();
  const std::optional<Wanted> found = by_pairs ? any_size : wanted(size.prior_sd, focal_sd);
  if (found && (solved || focal_solved)) {
    Eigen::Vector2d logs = found->scales.logs();
    scales.covariance = found->covariance;
    if (solved) {
      if (by_pairs) take_in(size.prior_sd, 0, logs, scales.covariance);
      size.estimate = std::exp(logs[0]);
      size.sd = size.estimate * std::sqrt(scales.covariance(0, 0));
      scales.information[0] = 1 / known_variance(size.prior_sd, logs[0]);
    } else {
      scales.covariance.row(0).setZero();
      scales.covariance.col(0).setZero();
    }
    if (focal_solved) {
      focal.estimate = std::exp(logs[1]);
      focal.sd = focal.estimate * std::sqrt(scales.covariance(1, 1));
      scales.information[1] = 1 / known_variance(focal.prior_sd, logs[1]);
    }
    scales.repeatable =
        scales.covariance - scales.covariance * scales.information.asDiagonal() * scales.covariance;
  }
  if (focal_solved || (seen && focal.far_off())) scales.focal_length = focal;
  loops = rescaled(std::move(loops), scales.estimate());
  return scales;
}

Eigen::Matrix<double, 6, 2> camera_by_scales(const std::vector<PoseLoop>& loops, const HandEyePoses& poses,
                                             const std::optional<AlongPrior>& along) {
  constexpr double kStep = 1e-3;
  const auto difference = [&](double SeenScales::*scale) -> Vector6d {
    const auto with = [&](double value) {
      SeenScales scales;
      scales.*scale = value;
      return fit_pose_space(rescaled(loops, scales), poses, {}, along).poses.X;
    };
    return motion_between(with(1 - kStep), with(1 + kStep)) / (2 * kStep);
  };
  Eigen::Matrix<double, 6, 2> by_scales;
  by_scales << difference(&SeenScales::size), difference(&SeenScales::focal_length);
  return by_scales;
}

void tell_scales(Calibration& result, const std::vector<PoseLoop>& loops,
                 const std::optional<AlongPrior>& along, const CalibrateSettings& settings) {
  tell_focal_length(result, loops, along, settings);
  tell_size(result, loops, along, settings);
}

void tell_size_of_few(Calibration& result, const std::vector<Observation>& all,
                      const CalibrateSettings& settings) {
  if (result.size->wanted) return;
  ConventionSettings any = settings.convention;
  any.suspicious = 0;  // a size that is off by a fifth still closes well
  const auto sized = check_size(result.setup, all, {Symmetry{}}, result.selection.robust_seed, any);
  if (sized) tell_first(result, sized->sentence, !settings.size_as_stated);
}

bool Unseen::plainly() const {
  constexpr std::size_t kFew = 10;  // one in so many may be an outlier
  return kFew * count > of;
}

Unseen unseen_targets(const std::vector<Observation>& observations) {
  constexpr double kSteepest = 3.7;  // tangent of 75 deg
  Unseen unseen;
  for (const Observation& observation : observations) {
    if (observation.T_camera_target.empty()) continue;
    const Eigen::Vector3d t = observation.T_camera_target.front().translation();
    ++unseen.of;
    unseen.count += t.z() > 0 && t.head<2>().norm() < kSteepest * t.z() ? 0 : 1;
  }
  return unseen;
}

}  // namespace flash::calib
