#pragma once
#include <random>
#include <vector>

#include "calib/geometry/pose_from_pixels.h"
#include "calib/geometry/projection.h"
#include "calib/solve/errors_in_variables.h"

namespace flash::calib {

/// A camera of 640 x 480 px, f = 615 px, and a robot whose poses are as noisy as told.
struct SceneSettings {
  Setup setup = Setup::eye_in_hand;
  int views = 15;
  double corner_px = 0.1;
  double robot_deg = 0, robot_mm = 0;         ///< per axis
  double distance = 0.42;                     ///< camera to target [m]
  Eigen::Vector3d spread{0.05, 0.035, 0.10};  ///< of the target's place in the camera frame, either way [m]
  double tilt_deg = 45;                       ///< of the target against the optical axis, at most
  double roll_deg = 90;                       ///< about the optical axis, at most
};

/// 15 views of a board of 9 x 6 corners, 25 mm, 0.32 to 0.52 m away; or 20 of a tag of 90 mm, about a metre
/// away.
inline SceneSettings protocol_settings(Setup setup) {
  if (setup == Setup::eye_in_hand) return {};
  SceneSettings settings{.setup = setup, .views = 20};
  settings.distance = 0.9;
  settings.spread = {0.15, 0.10, 0.30};
  settings.tilt_deg = 50;
  settings.roll_deg = 60;
  return settings;
}

struct HandEyeScene {
  SceneSettings settings;
  data::CameraIntrinsics camera{
      .width = 640, .height = 480, .fx = 615, .fy = 615, .cx = 319.5, .cy = 239.5, .distortion = {}};
  Eigen::Matrix3Xd points;
  HandEyePoses truth;
  std::vector<Observation> observations;
  std::vector<Eigen::Isometry3d> true_poses;             ///< T_base_gripper
  std::vector<Eigen::Matrix<double, 6, 1>> joints = {};  ///< of arms [rad]
};

inline Eigen::Isometry3d make_pose(const Eigen::Vector3d& translation, const Eigen::Vector3d& rotation) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation() = translation;
  T.linear() = rotation_exp(rotation);
  return T;
}

/// 9 x 6 inner corners of 25 mm squares, and the corners of a tag of 90 mm.
inline Eigen::Matrix3Xd board_points(int columns = 9, int rows = 6, double square = 0.025) {
  Eigen::Matrix3Xd points(3, columns * rows);
  for (int i = 0; i < columns * rows; ++i)
    points.col(i) =
        square * Eigen::Vector3d(i % columns, i / columns, 0);  // NOLINT(bugprone-integer-division)
  return points;
}
inline Eigen::Matrix3Xd tag_points(double side = 0.09) {
  Eigen::Matrix3Xd points(3, 4);
  points << -1, 1, 1, -1, -1, -1, 1, 1, 0, 0, 0, 0;
  return 0.5 * side * points;
}

inline HandEyeScene make_scene(const SceneSettings& settings, const Eigen::Matrix3Xd& points, unsigned seed) {
  HandEyeScene scene{
      .settings = settings, .points = points, .truth = {}, .observations = {}, .true_poses = {}};
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::normal_distribution<double> normal;
  const auto uniform3 = [&] { return Eigen::Vector3d(uniform(random), uniform(random), uniform(random)); };
  const auto normal3 = [&] { return Eigen::Vector3d(normal(random), normal(random), normal(random)); };
  const bool in_hand = settings.setup == Setup::eye_in_hand;
  // Mount in the hand, and what stands in the world about a metre from the base.
  const Eigen::Isometry3d in_gripper =
      make_pose(Eigen::Vector3d(0.05, 0.02, 0.08) + 0.03 * uniform3(), 0.5 * uniform3());
  const Eigen::Isometry3d in_world =
      make_pose(Eigen::Vector3d(0.6, 0.1, 0.3) + 0.1 * uniform3(), 3 * uniform3());
  scene.truth = in_hand ? HandEyePoses{in_gripper, in_world} : HandEyePoses{in_world, in_gripper};
  const Eigen::Vector3d centre = points.rowwise().mean();
  constexpr double kDegree = M_PI / 180;
  for (int i = 0; i < settings.views; ++i) {
    const double heading = M_PI * uniform(random),
                 tilt = settings.tilt_deg * kDegree * std::sqrt(std::abs(uniform(random)));
    const double roll = settings.roll_deg * kDegree * uniform(random);
    Eigen::Isometry3d T_camera_target = Eigen::Isometry3d::Identity();
    T_camera_target.linear() =
        rotation_exp({tilt * std::cos(heading), tilt * std::sin(heading), 0}) * rotation_exp({0, 0, roll});
    const Eigen::Vector3d place =
        Eigen::Vector3d(0, 0, settings.distance) + settings.spread.cwiseProduct(uniform3());
    T_camera_target.translation() = place - T_camera_target.linear() * centre;
    const Eigen::Isometry3d& X = scene.truth.X;
    const Eigen::Isometry3d& Z = scene.truth.Z;
    const Eigen::Isometry3d pose =
        in_hand ? Z * T_camera_target.inverse() * X.inverse() : X * T_camera_target * Z.inverse();
    Observation observation;
    Vector6d error;
    error << settings.robot_mm * 1e-3 * normal3(), settings.robot_deg * kDegree * normal3();
    observation.T_base_gripper = moved(pose, error);
    observation.image = std::to_string(i);
    observation.pixels.resize(2, points.cols());
    for (Eigen::Index k = 0; k < points.cols(); ++k) {
      observation.points.push_back(static_cast<int>(k));
      observation.pixels.col(k) = project(to_vector(scene.camera), T_camera_target * points.col(k)) +
                                  settings.corner_px * Eigen::Vector2d(normal(random), normal(random));
    }
    observation.T_camera_target = {fitted_pose(scene.camera, points, observation.pixels, T_camera_target)};
    scene.observations.push_back(std::move(observation));
    scene.true_poses.push_back(pose);
  }
  return scene;
}

inline Eigen::Matrix3Xd protocol_points(Setup setup) {
  return setup == Setup::eye_in_hand ? board_points() : tag_points();
}

inline HandEyeScene protocol_scene(Setup setup, double robot_deg, double robot_mm, unsigned seed) {
  SceneSettings settings = protocol_settings(setup);
  settings.robot_deg = robot_deg;
  settings.robot_mm = robot_mm;
  return make_scene(settings, protocol_points(setup), seed);
}

inline std::vector<PoseLoop> loops_of(const HandEyeScene& scene) {
  std::vector<PoseLoop> loops;
  for (const Observation& observation : scene.observations)
    loops.push_back(
        pose_loop(scene.settings.setup, observation.T_base_gripper, observation.T_camera_target.front()));
  return loops;
}

/// The bundle at the closed form of Shah.
inline Bundle seeded_bundle(const HandEyeScene& scene) {
  return make_bundle(scene.settings.setup, scene.camera, scene.points, scene.observations,
                     shah(loops_of(scene)));
}

/// The same as pairs of poses, which no camera sees.
inline std::vector<Observation> pairs_of(const HandEyeScene& scene) {
  std::vector<Observation> pairs = scene.observations;
  for (Observation& pair : pairs) {
    pair.points.clear();
    pair.pixels.resize(2, 0);
  }
  return pairs;
}

}  // namespace flash::calib
