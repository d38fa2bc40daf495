#include "calib/calibrate/expect_convention.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "data/files/error.h"

namespace flash::calib {
namespace {

constexpr double kDegree = M_PI / 180;

/// "from a.png to b.png the robot turns by 137.0 deg and the camera sees 27.0 deg", of the two views that
/// differ most: angles do not depend on where the camera is.
std::string worst_pair(Setup setup, const std::vector<Observation>& observations) {
  std::vector<const Observation*> seen;
  for (const Observation& observation : observations)
    if (!observation.T_camera_target.empty()) seen.push_back(&observation);
  const auto loop_of = [&](const Observation& view) {
    return pose_loop(setup, view.T_base_gripper, view.T_camera_target.front());
  };
  double worst = -1, robot = 0, camera = 0;
  const Observation *from = nullptr, *to = nullptr;
  for (std::size_t i = 0; i < seen.size(); ++i)
    for (std::size_t j = i + 1; j < seen.size(); ++j) {
      const PoseLoop a = loop_of(*seen[i]), b = loop_of(*seen[j]);
      const double by_robot = rotation_angle(a.G.linear().transpose() * b.G.linear()),
                   by_camera = rotation_angle(a.C.linear() * b.C.linear().transpose());
      if (!(std::abs(by_robot - by_camera) > worst)) continue;
      worst = std::abs(by_robot - by_camera);
      robot = by_robot;
      camera = by_camera;
      from = seen[i];
      to = seen[j];
    }
  if (from == nullptr) return "no two views have the target";
  char text[240];
  std::snprintf(text, sizeof text,
                "from %.60s to %.60s the robot turns by %.1f deg, and the target by %.1f deg",
                from->image.c_str(), to->image.c_str(), robot / kDegree, camera / kDegree);
  return text;
}

}  // namespace

void expect_convention(Setup setup, const std::vector<Observation>& observations,
                       const std::vector<Symmetry>& symmetries, const RobustSeed& stated,
                       const CalibrateSettings& settings) {
  const std::optional<Finding> finding =
      check_convention(setup, observations, symmetries, stated, settings.angles, settings.convention);
  if (finding) throw data::InputError(finding->sentence);
  if (const std::optional<Finding> pairing =
          check_pairing(setup, observations, symmetries, stated, settings.convention))
    throw data::InputError(pairing->sentence);
  const bool hopeless = !(stated.found && stated.score < settings.hopeless);
  const std::optional<Finding> sized =
      check_size(setup, observations, symmetries, stated, settings.convention);
  if (sized && (hopeless || !measurable_size(sized->size))) throw data::InputError(sized->sentence);
  if (!hopeless) return;
  if (!stated.found)
    throw data::InputError(
        "robot and camera do not tell of the same motion: no three of " +
        std::to_string(observations.size()) +
        " views turn by the same angles, and no other convention explains them; " +
        worst_pair(setup, observations) +
        ": check that each picture, or pose of the target, stands beside the robot's pose of its moment");
  constexpr double kTurnsAgree = 1 * kDegree;
  char text[500];
  std::snprintf(
      text, sizeof text,
      "robot and camera do not tell of the same motion: most views close to no better than %.1f deg and "
      "%.0f mm, and no other convention explains them; %s",
      stated.rotation / kDegree, 1e3 * stated.translation,
      stated.found && stated.rotation < kTurnsAgree
          ? "turns agree and places do not: look for mirrored pictures, and for places in other columns"
          : (worst_pair(setup, observations) + ": check that each image stands beside its pose").c_str());
  throw data::InputError(text);
}

void expect_motion(const std::vector<Eigen::Isometry3d>& T_base_gripper) {
  constexpr double kNone = 1e-9;  // [m], [rad]: what a file's digits leave
  const bool moves =
      std::any_of(T_base_gripper.begin(), T_base_gripper.end(),
                  [&](const Eigen::Isometry3d& T) { return !T.isApprox(T_base_gripper.front(), kNone); });
  if (!moves && T_base_gripper.size() > 1)
    throw data::InputError(
        "the robot does not move in any row: its " + std::to_string(T_base_gripper.size()) +
        " poses are all the same; check that they are read anew for each picture, and from "
        "the robot that moves");
}

}  // namespace flash::calib
