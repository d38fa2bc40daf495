#include "calib/calibrate/calibrate_images.h"

#include <Eigen/Cholesky>
#include <cmath>
#include <cstdio>

#include "calib/calibrate/plausibility.h"
#include "calib/dataset/symmetry.h"
#include "calib/solve/linearization.h"
#include "calib/uncertainty/corner_noise_ratios.h"
#include "calib/uncertainty/joint_errors.h"
#include "data/files/error.h"
#include "data/numbers/chi_square.h"

namespace flash::calib {
namespace {

/// A view for each picture, without poses where the target was not found.
std::vector<Observation> views_of(const std::vector<Detection>& detections, const std::string& refiner) {
  const std::vector<Observation> found = observations_of(detections, refiner);
  std::vector<Observation> views;
  auto next = found.begin();
  for (const Detection& detection : detections) {
    Observation missing;
    missing.image = detection.image;
    views.push_back(detection.readings.empty() ? missing : *next++);
  }
  return views;
}

template <class... Values>
std::string formatted(const char* format, const Values&... values) {
  char text[320];
  std::snprintf(text, sizeof text, format, values...);
  return text;
}

/// What calibrate() is called with, apart from the views.
struct Problem {
  Setup setup;
  const data::CameraIntrinsics& camera;
  Eigen::Matrix3Xd points;
  std::vector<Symmetry> symmetries;

  Calibration solve(const std::vector<Observation>& views, const CalibrateSettings& settings) const {
    return calibrate(setup, camera, points, symmetries, views, settings);
  }
};

std::vector<double> stamps_of(const Dataset& dataset) {
  std::vector<double> stamps;
  for (const Frame& frame : dataset.frames) stamps.push_back(frame.stamp);
  return stamps;
}

/// Whether an offset of 20 ms puts the gripper as far off as arms repeat to, or farther.
bool moves_at_pictures(const Dataset& dataset) {
  constexpr double kRepeatable = 1e-4, kUsualOffset = 0.02;  // [m, s]
  std::vector<Observation> views(dataset.frames.size());
  for (Observation& view : views) view.T_camera_target = {Eigen::Isometry3d::Identity()};
  return kUsualOffset * rms_speed(placed(*dataset.stream, stamps_of(dataset), 0, std::move(views))) >
         kRepeatable;
}

TimeOffset offset_left(const Bundle& bundle, const Unknowns& unknowns, const Eigen::MatrixXd& covariance) {
  const int column = shared_columns(bundle, unknowns).time_offsets.front();
  return {bundle.time_offsets.front(), std::sqrt(covariance(column, column))};
}

/// Noise of the robot that an offset makes is the offset's, and needs no cause of its own. True where the
/// answer was refused for it.
bool drop_noise_of_offset(const NoiseLevels& with_offset, Calibration& result) {
  const NoiseLevels& without = result.refined.noise;
  constexpr double kExplained = 0.5;  // of the noise
  if (with_offset.translation.front() > kExplained * without.translation.front() &&
      with_offset.rotation.front() > kExplained * without.rotation.front())
    return false;
  bool unusable = false;
  const std::string noisy = unusual_noise(without, unusable);
  if (noisy.empty()) return false;
  const auto of_noise = [&](const std::string& sentence) { return sentence.starts_with(noisy); };
  std::erase_if(result.warnings, of_noise);
  return std::erase_if(result.refusals, of_noise) > 0;
}

/// Tells where the poses' clock and the pictures' differ, in a solution that took them to be one. An answer
/// that depends on it is none.
void check_time(const Dataset& dataset, const CalibrateSettings& settings, Calibration& result) {
  RefineSettings with_offset = settings.refine;
  with_offset.estimate_pivots = false;
  with_offset.noise = result.refined.noise;
  with_offset.bundle.unknowns.time_offsets = true;
  Bundle bundle = result.refined.bundle;
  double squares = 0;
  for (std::size_t k = 0; k < bundle.poses.size(); ++k) {
    const Frame& frame = dataset.frames[static_cast<std::size_t>(result.used[k])];
    const std::optional<Motion> motion = motion_at(*dataset.stream, frame.stamp);
    if (motion) bundle.poses[k].velocity = motion->velocity;
    squares += bundle.poses[k].velocity.head<3>().squaredNorm();
  }
  if (squares < 1e-6 * static_cast<double>(bundle.poses.size())) return;  // slower than 1 mm/s
  const Refinement refined = refine(std::move(bundle), with_offset);
  const TimeOffset offset = offset_left(refined.bundle, with_offset.bundle.unknowns, refined.covariance);
  if (!(std::abs(offset.estimate) > 5 * offset.sd)) return;
  // The noise that the offset makes would hide what it does: that of the solution with the offset counts.
  const Vector6d away = motion_between(result.poses.X, refined.bundle.cameras.front());
  const Matrix6d covariance = refined.covariance.topLeftCorner<6, 6>();
  const bool refused = drop_noise_of_offset(refined.noise, result);
  tell_first(
      result,
      formatted("pictures and poses are %.1f +- %.1f ms apart, and with that the camera is %.1f mm and "
                "%.2f deg from where it is here: leave --no-time-offset out",
                1e3 * offset.estimate, 1e3 * offset.sd, 1e3 * away.head<3>().norm(),
                away.tail<3>().norm() * 180 / M_PI),
      refused || away.dot(covariance.ldlt().solve(away)) > data::chi_square_999_of_6);
}

/// Names the pictures whose corners count much less than those of others.
void warn_of_blur(const std::vector<Observation>& views, Calibration& result) {
  constexpr double kMuch = 2;
  std::string names;
  int blurred = 0;
  for (const int i : result.used) {
    const Observation& view = views[static_cast<std::size_t>(i)];
    if (!(view.corner_noise > kMuch)) continue;
    names += (names.empty() ? "" : ", ") + view.image;
    ++blurred;
  }
  if (blurred > 0)
    result.warnings.push_back("corners scatter more than twice as far as elsewhere in " + names +
                              ": blurred by the motion? They count as much less");
}

/// Solves with the poses as the stream has them at the pictures' times, and again at the times found, until
/// less than a twentieth of a standard deviation is left: velocities then need to hold for no time at all.
Calibration calibrate_stream(const Problem& problem, const Dataset& dataset, std::vector<Observation> views,
                             const CalibrateSettings& settings, TimeOffset& offset) {
  constexpr int kRounds = 6;
  constexpr double kUnknown = 0.1;  // a standard deviation that says nothing [s]
  const std::vector<double> stamps = stamps_of(dataset);
  offset.estimate = coarse_offset(problem.setup, *dataset.stream, stamps, views, problem.symmetries);
  CalibrateSettings quick = settings;
  quick.folds = 2;
  for (int round = 0;; ++round) {
    std::vector<std::size_t> beyond;
    const std::vector<Observation> moved_views =
        placed(*dataset.stream, stamps, offset.estimate, views, &beyond);
    const double speed = rms_speed(moved_views);
    if (speed < 1e-3)
      throw data::InputError(
          "the robot stands still at every picture: a time offset cannot be determined, and none is needed; "
          "leave --time-offset out");
    const bool last = round == kRounds;
    Calibration result = problem.solve(moved_views, last ? settings : quick);
    const TimeOffset left = offset_left(result.refined.bundle, result.unknowns, result.shared_covariance);
    offset.sd = left.sd;
    if (!(offset.sd < kUnknown))
      throw data::InputError(
          formatted("the robot moves too slowly at the pictures (%.1f mm/s) to find a time offset (it would "
                    "be known to "
                    "+- %.0f ms); leave --time-offset out",
                    1e3 * speed, 1e3 * offset.sd));
    if (last) {
      offset.estimate += left.estimate;
      offset.sd *= std::sqrt(result.covariance_factor);  // as the transform's
      warn_of_blur(views, result);
      for (const std::size_t i : beyond)
        result.selection.views[i].reason = result.views[i].reason =
            "its time lies beyond the poses of " + dataset.poses_path;
      return result;
    }
    const std::vector<double> ratios = corner_noise_ratios(result.refined.bundle);
    for (std::size_t k = 0; k < result.used.size(); ++k)
      views[static_cast<std::size_t>(result.used[k])].corner_noise = ratios[k];
    if (std::abs(left.estimate) < 0.05 * left.sd)
      round = kRounds - 1;  // once more, with everything that the answer holds
    else
      offset.estimate += left.estimate;
  }
}

/// What the solution says of the depth that took part, and what people should know of it.
void report_depth(const DepthUse& use, ImageCalibration& result) {
  DepthUse& depth = result.depth.emplace(use);
  Calibration& calibration = result.calibration;
  for (const std::string& reason : depth.unreadable)
    calibration.warnings.push_back(reason + "; the view was used without depth");
  if (!depth.used) {
    calibration.warnings.push_back("depth was not used: " + depth.reason);
    return;
  }
  const Refinement& refined = calibration.refined;
  const int column = shared_columns(refined.bundle, calibration.unknowns).depth_scales.front();
  if (column < 0) return;
  depth.sigma = refined.noise.depth.front();
  depth.over_corners = refined.bundle.depth_scales.front();
  depth.over_corners_sd = std::sqrt(calibration.shared_covariance(column, column));
  const double off = std::abs(depth.over_corners - 1);
  if (off > 0.01 && off > 5 * depth.over_corners_sd)
    calibration.warnings.push_back(
        formatted("depth puts the target at %.4f +- %.4f times the distance that its corners say: depth, the "
                  "target's size or the lens is wrong by that much",
                  depth.over_corners, 2 * depth.over_corners_sd));
}

/// Joints and links that are grossly off. Where motions of first order no longer hold what the answer is
/// known to, there is none.
void tell_joints(const JointErrors& errors, const ArmModel& arm, Calibration& result) {
  for (std::string& sentence : joints_far_off(errors, arm)) result.warnings.push_back(std::move(sentence));
  double distance = 0;
  for (const RobotPose& pose : result.refined.bundle.poses)
    distance = std::max(distance, pose.T_base_gripper.translation().norm());
  const double rough = second_order(errors, arm, distance),
               known = std::sqrt(result.covariance.topLeftCorner<3, 3>().trace() / 3);
  if (!(rough > known)) return;
  char text[240];
  std::snprintf(
      text, sizeof text,
      "zeros of joints are so far off that places are wrong by up to %.1f mm to second order: put them "
      "into the URDF (export --despite-doubts --joint-origins), and calibrate with that file",
      1e3 * rough);
  tell_first(result, text, true);
}

}  // namespace

ImageCalibration calibrate_images(Setup setup, const Dataset& dataset, const Target& target,
                                  const std::vector<Detection>& detections,
                                  const std::optional<DepthViews>& depth, CalibrateSettings settings) {
  constexpr double kTie = 1.05;
  for (const Frame& frame : dataset.frames)
    if (frame.angles) settings.angles.push_back(*frame.angles);
  if (settings.angles.size() != dataset.frames.size()) settings.angles.clear();
  if (settings.clock_offset == ClockOffset::solved && !dataset.stream)
    throw data::InputError(dataset.poses_path +
                           ": found one pose a picture, expected a stream of poses over time, with pictures "
                           "named by their time, to find a time offset");
  const bool timed = settings.clock_offset == ClockOffset::solved ||
                     (settings.clock_offset == ClockOffset::where_it_matters && dataset.stream &&
                      moves_at_pictures(dataset));
  settings.refine.bundle.unknowns.time_offsets = timed;
  const Problem problem{setup, *dataset.camera, target_points(target), confusable_symmetries(target)};
  const std::vector<RefinerScore> ranking = rank_refiners(detections);
  const auto calibrated = [&](const std::string& refiner) {
    std::vector<Observation> views = views_of(detections, refiner);
    for (std::size_t i = 0; depth && i < views.size(); ++i) views[i].depth_points = depth->points[i];
    ImageCalibration result{.calibration = {}, .refiner = refiner};
    if (timed)
      result.calibration = calibrate_stream(problem, dataset, views, settings, result.time_offset.emplace());
    else
      result.calibration = problem.solve(views, settings);
    return result;
  };
  ImageCalibration best = calibrated(ranking.front().refiner);
  for (std::size_t i = 1; i < ranking.size() && ranking[i].rms <= kTie * ranking.front().rms; ++i) {
    ImageCalibration other = calibrated(ranking[i].refiner);
    if (other.calibration.held_out.px < best.calibration.held_out.px) best = std::move(other);
  }
  for (std::size_t i = 0; i < detections.size(); ++i)
    if (!detections[i].reason.empty()) best.calibration.views[i].reason = detections[i].reason;
  if (dataset.stream && !timed) check_time(dataset, settings, best.calibration);
  if (depth) report_depth(depth->use, best);
  const Calibration& answer = best.calibration;
  const auto errors = joint_errors(answer.refined.bundle, answer.unknowns, answer.shared_covariance);
  if (errors && dataset.arm) tell_joints(*errors, *dataset.arm, best.calibration);
  return best;
}

}  // namespace flash::calib
