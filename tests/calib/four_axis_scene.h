#pragma once
#include "tests/calib/hand_eye_scene.h"

namespace flash::calib {

/// An arm whose gripper points down and turns about the vertical of its base, as those of four axes do.
struct FourAxisSettings {
  Setup setup = Setup::eye_in_hand;
  int views = 20;
  double corner_px = 0.1;
  double robot_deg = 0.05, robot_mm = 0.3;  ///< by which the true pose is off the reported one, per axis
  double tilt_deg = 0;                      ///< of reported poses about the other axes, per axis
  double turn_deg = 80;                     ///< either way
  Eigen::Matrix3d mount = Eigen::Matrix3d::Identity();  ///< turns base and gripper with all that they hold
};

/// 9 x 6 corners of 25 mm, 0.34 to 0.50 m before a camera that looks down, tilted by some 15 deg.
inline HandEyeScene make_four_axis_scene(const FourAxisSettings& settings, unsigned seed) {
  HandEyeScene scene;
  scene.settings.setup = settings.setup;
  scene.points = board_points();
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::normal_distribution<double> normal;
  const auto uniform3 = [&] { return Eigen::Vector3d(uniform(random), uniform(random), uniform(random)); };
  const auto normal3 = [&] { return Eigen::Vector3d(normal(random), normal(random), normal(random)); };
  constexpr double kDegree = M_PI / 180;
  const bool in_hand = settings.setup == Setup::eye_in_hand;
  const Eigen::Isometry3d down = make_pose(Eigen::Vector3d::Zero(), {M_PI, 0, 0});
  const Eigen::Isometry3d world(settings.mount);
  const Eigen::Isometry3d in_gripper =
      make_pose(Eigen::Vector3d(0.05, 0.02, 0.08) + 0.03 * uniform3(), 0.3 * uniform3());
  const Eigen::Isometry3d in_world =
      world * make_pose(Eigen::Vector3d(0.5, 0.1, 0.3) + 0.1 * uniform3(), Eigen::Vector3d::Zero()) * down *
      make_pose(Eigen::Vector3d::Zero(), 0.3 * uniform3());
  scene.truth = in_hand ? HandEyePoses{in_gripper, in_world} : HandEyePoses{in_world, in_gripper};
  const Eigen::Vector3d centre = scene.points.rowwise().mean();
  for (int i = 0; i < settings.views; ++i) {
    Eigen::Isometry3d reported =
        world * make_pose(Eigen::Vector3d::Zero(), {0, 0, settings.turn_deg * kDegree * uniform(random)}) *
        down;
    Eigen::Vector3d tilt = settings.tilt_deg * kDegree * normal3();
    tilt.z() = 0;
    reported.linear() *= rotation_exp(tilt);
    // So that the middle of the target is seen there.
    const Eigen::Vector3d seen =
        Eigen::Vector3d(0, 0, 0.42) + Eigen::Vector3d(0.05, 0.035, 0.08).cwiseProduct(uniform3());
    const Eigen::Vector3d held = in_hand ? Eigen::Vector3d(scene.truth.X * seen)
                                         : Eigen::Vector3d(scene.truth.Z * centre),
                          stands = in_hand ? Eigen::Vector3d(scene.truth.Z * centre)
                                           : Eigen::Vector3d(scene.truth.X * seen);
    reported.translation() = stands - reported.linear() * held;
    Vector6d error;
    error << settings.robot_mm * 1e-3 * normal3(), settings.robot_deg * kDegree * normal3();
    const Eigen::Isometry3d pose = moved(reported, error);
    const Eigen::Isometry3d T_camera_target =
        scene.truth.X.inverse() * (in_hand ? pose.inverse() : pose) * scene.truth.Z;
    Observation observation;
    observation.T_base_gripper = reported;
    observation.image = std::to_string(i);
    observation.pixels.resize(2, scene.points.cols());
    for (Eigen::Index k = 0; k < scene.points.cols(); ++k) {
      observation.points.push_back(static_cast<int>(k));
      observation.pixels.col(k) = project(to_vector(scene.camera), T_camera_target * scene.points.col(k)) +
                                  settings.corner_px * Eigen::Vector2d(normal(random), normal(random));
    }
    observation.T_camera_target = {
        fitted_pose(scene.camera, scene.points, observation.pixels, T_camera_target)};
    scene.observations.push_back(std::move(observation));
    scene.true_poses.push_back(pose);
  }
  return scene;
}

}  // namespace flash::calib
