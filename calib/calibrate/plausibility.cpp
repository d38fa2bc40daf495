#include "calib/calibrate/plausibility.h"

#include <cmath>
#include <cstdio>

#include "data/numbers/median.h"

namespace flash::calib {
namespace {

constexpr double kDegree = M_PI / 180;
constexpr const char* kAdvice =
    "check that each picture stands beside its pose, and what the columns of the poses mean";

/// Rms distance of places and rms angle between the poses and their mean.
struct Motion {
  double translation = 0, rotation = 0;  ///< [m], [rad]
  double over(double distance) const { return std::hypot(rotation, translation / distance); }
};

Motion motion_of(const std::vector<Eigen::Isometry3d>& poses) {
  const Eigen::Isometry3d mean = mean_pose(poses);
  Motion motion;
  for (const Eigen::Isometry3d& pose : poses) {
    motion.translation += (pose.translation() - mean.translation()).squaredNorm();
    motion.rotation += std::pow(rotation_angle(mean.linear().transpose() * pose.linear()), 2);
  }
  const auto count = static_cast<double>(poses.size());
  return {std::sqrt(motion.translation / count), std::sqrt(motion.rotation / count)};
}

/// Rms of views left out, in the middle one of the folds: a view that alone tells an axis is predicted by
/// none.
double typical(const HeldOut& held, int measure, double of_all) {
  return held.squares.empty() ? of_all : std::sqrt(data::median(means_of_folds(held, measure)));
}

template <class... Values>
std::string formatted(const char* format, const Values&... values) {
  char text[400];
  std::snprintf(text, sizeof text, format, values...);
  return text;
}

}  // namespace

std::string implausible_noise(const NoiseLevels& levels, const std::vector<Observation>& used,
                              const PlausibilitySettings& settings) {
  std::vector<Eigen::Isometry3d> robot;
  double distance = 0;
  for (const Observation& view : used) {
    robot.push_back(view.T_base_gripper);
    distance += view.T_camera_target.front().translation().norm() / static_cast<double>(used.size());
  }
  const Motion moved = motion_of(robot);
  const Motion noise{std::sqrt(3) * levels.translation.front(), std::sqrt(3) * levels.rotation.front()};
  // Turns that are right do not make up for places that are not.
  const bool places = noise.translation < settings.noise * moved.translation ||
                      noise.translation < settings.deviation * distance;
  if (places && noise.over(distance) < settings.noise * moved.over(distance)) return {};
  return formatted(
      "robot and camera do not tell of the same motion: the robot's poses would have to be wrong by %.1f mm "
      "and "
      "%.2f deg, of %.1f mm and %.2f deg that it moved; %s",
      1e3 * noise.translation, noise.rotation / kDegree, 1e3 * moved.translation, moved.rotation / kDegree,
      kAdvice);
}

std::string unusual_noise(const NoiseLevels& noise, bool& unusable, const ArmNoise& arm) {
  const double translation = noise.translation.front(), rotation = noise.rotation.front();
  if (translation < arm.doubtful_m && rotation < arm.doubtful_rad) return {};
  unusable = unusable || translation > arm.unusable_m || rotation > arm.unusable_rad;
  return formatted(
      "the robot's poses would have to be wrong by %.1f mm and %.2f deg an axis, more than arms are: look "
      "for poses of two "
      "tools or two bases, for mirrored pictures, for a marker that is not where it was; %s",
      1e3 * translation, rotation / kDegree, kAdvice);
}

std::string unusual_scatter(const NoiseLevels& noise, const ArmNoise& arm) {
  const double translation = noise.translation.front(), rotation = noise.rotation.front();
  if (translation < arm.doubtful_m && rotation < arm.doubtful_rad) return {};
  return formatted(
      "robot and camera scatter by %.1f mm and %.2f deg an axis together, and pairs of poses do not tell "
      "whose it "
      "is: the stated deviations hold it; if the camera sees the target better than that, %s",
      1e3 * translation, rotation / kDegree, kAdvice);
}

std::string implausibility(const Calibration& calibration, const std::vector<Observation>& used,
                           const PlausibilitySettings& settings) {
  std::vector<Eigen::Isometry3d> target;
  double distance = 0;
  for (const Observation& view : used) {
    target.push_back(view.T_camera_target.front());
    distance += view.T_camera_target.front().translation().norm() / static_cast<double>(used.size());
  }
  const Motion still = motion_of(target);  // of the target in the camera, whose middle a fixed pose would be
  const HeldOut& held = calibration.held_out;
  const Motion left{1e-3 * typical(held, 1, held.mm), kDegree * typical(held, 2, held.deg)};
  if (!(left.over(distance) < settings.held_out * still.over(distance)))
    return formatted(
        "robot and camera do not tell of the same motion: views left out are predicted to %.1f mm and %.2f "
        "deg, where taking the target to stand still before the camera is as good as %.1f mm and %.2f deg; "
        "%s",
        1e3 * left.translation, left.rotation / kDegree, 1e3 * still.translation, still.rotation / kDegree,
        kAdvice);
  if (std::string noisy = implausible_noise(calibration.refined.noise, used, settings); !noisy.empty())
    return noisy;
  return unknown_place("the camera", calibration.covariance, distance, settings);
}

std::string unknown_place(const std::string& what, const Matrix6d& covariance, double distance,
                          const PlausibilitySettings& settings) {
  const double place = std::sqrt(covariance.topLeftCorner<3, 3>().trace() / 3),
               turn = std::sqrt(covariance.bottomRightCorner<3, 3>().trace() / 3);
  if (place < settings.deviation * distance && turn < settings.deviation) return {};
  return formatted(
      "%s's place is known to no better than %.0f mm and %.1f deg, at %.0f mm from the target: "
      "that is no answer; add views that tilt by 20 to 40 deg about two axes; %s",
      what.c_str(), 1e3 * place, turn / kDegree, 1e3 * distance, kAdvice);
}

}  // namespace flash::calib
