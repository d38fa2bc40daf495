#include "calib/uncertainty/observability.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "calib/calibrate/calibrate.h"
#include "tests/calib/hand_eye_scene.h"

namespace flash::calib {
namespace {

/// A head that pans and tilts before a board: two axes and no other motion.
HandEyeScene pan_tilt_scene() {
  SceneSettings settings;
  settings.views = 40;
  HandEyeScene scene = make_scene(settings, board_points(), 1);
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  const Eigen::Isometry3d X =
      make_pose({0.05, 0.03, 0.04}, {-M_PI / 2, 0, 0.02}) * make_pose({0, 0, 0}, {0, 0.02, 0});
  scene.truth.X = X;
  scene.truth.Z = make_pose({-0.1, 0.9, 1.15}, {-M_PI / 2 + 0.3, 0.2, 0.1});
  const Eigen::Isometry3d neck = make_pose({0, 0, 1.2}, Eigen::Vector3d::Zero());
  for (std::size_t i = 0; i < scene.observations.size(); ++i) {
    const double pan = 0.25 * std::sin(0.7 * static_cast<double>(i)),
                 tilt = 0.2 * std::sin(1.9 * static_cast<double>(i));
    Observation& o = scene.observations[i];
    const Eigen::Isometry3d pose =
        neck * make_pose({0, 0, 0}, {0, 0, pan}) * make_pose({0, 0, 0.05}, {tilt, 0, 0});
    Vector6d error;
    for (int k = 0; k < 6; ++k) error[k] = normal(random) * (k < 3 ? 2e-4 : 3e-4);
    o.T_base_gripper = moved(pose, error);
    const Eigen::Isometry3d T = X.inverse() * pose.inverse() * scene.truth.Z;
    for (Eigen::Index k = 0; k < scene.points.cols(); ++k)
      o.pixels.col(k) = project(to_vector(scene.camera), T * scene.points.col(k)) +
                        0.1 * Eigen::Vector2d(normal(random), normal(random));
    o.T_camera_target = {fitted_pose(scene.camera, scene.points, o.pixels, T)};
  }
  return scene;
}

TEST(Observability, PanTiltHeadIsSolvedAndItsWeakestDirectionNamed) {
  const HandEyeScene scene = pan_tilt_scene();
  std::mt19937 random(2);
  std::normal_distribution<double> normal;
  const Calibration result = calibrate(Setup::eye_in_hand, scene.camera, scene.points,
                                       grid_symmetries(scene.points), scene.observations);
  const Vector6d error = motion_between(result.poses.X, scene.truth.X);
  EXPECT_LT(error.dot(result.covariance.ldlt().solve(error)), 22.5);  // 99.9 % of chi-square, 6
  EXPECT_LT(result.diversity.spread[2], 0.2 * result.diversity.spread[1]);
  // By brute force: no direction of (dt / length, dtheta) has a larger variance than the one named.
  EXPECT_FALSE(result.weakest.name.empty());
  const double length = scene.observations.front().T_camera_target.front().translation().norm();
  const WeakestDirection weakest = weakest_direction(result.covariance, length, "camera");
  const double largest = std::pow(weakest.translation / length, 2) + weakest.rotation * weakest.rotation;
  for (int i = 0; i < 5000; ++i) {
    Vector6d direction = Vector6d::NullaryExpr([&] { return normal(random); }).normalized();
    direction.head<3>() /= length;
    EXPECT_LE(direction.dot(result.covariance * direction), largest * (1 + 1e-9));
  }
}

TEST(Observability, SpreadOfTurnsIsThatOfTheirLogarithms) {
  std::vector<Eigen::Isometry3d> poses;
  for (const double angle : {-0.2, 0.2}) {
    poses.push_back(make_pose({0, 0, 0}, {angle, 0, 0}));
    poses.push_back(make_pose({0, 0, 0}, {0, angle / 2, 0}));
  }
  const RotationDiversity diversity = rotation_diversity(poses);
  // Six pairs: 0.4 about x once, 0.2 about y once, and four of nearly (0.2, 0.1, 0).
  EXPECT_NEAR(diversity.spread[0], std::sqrt((0.16 + 4 * 0.04) / 6), 1e-3);
  EXPECT_NEAR(diversity.spread[1], std::sqrt((0.04 + 4 * 0.01) / 6), 1e-3);
  EXPECT_LT(diversity.spread[2], 0.011);  // what turns about x and y leave about z, half their product
  EXPECT_TRUE(degeneracy(diversity).empty());
}

}  // namespace
}  // namespace flash::calib
