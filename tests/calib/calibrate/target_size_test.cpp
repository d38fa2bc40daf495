#include "calib/solve/target_size.h"

#include <gtest/gtest.h>

#include "calib/calibrate/calibrate.h"
#include "calib/check/projection_check.h"
#include "tests/calib/hand_eye_scene.h"

namespace flash::calib {
namespace {

/// A scene whose printed target is `scale` times as large as the points that are handed over.
HandEyeScene scene_of(Setup setup, double scale, unsigned seed) {
  SceneSettings settings = protocol_settings(setup);
  settings.views = 20;
  settings.robot_deg = 0.05;
  settings.robot_mm = 0.5;
  HandEyeScene scene = make_scene(settings, scale * board_points(), seed);
  scene.points /= scale;
  for (Observation& o : scene.observations)
    o.T_camera_target = {
        fitted_pose(scene.camera, scene.points(Eigen::all, o.points), o.pixels, o.T_camera_target.front())};
  return scene;
}

Calibration calibrated(const HandEyeScene& scene, TargetSize size) {
  CalibrateSettings settings;
  settings.target_size = size;
  return calibrate(scene.settings.setup, scene.camera, scene.points, grid_symmetries(scene.points),
                   scene.observations, settings);
}

double millimetres_off(const Calibration& result, const HandEyeScene& scene) {
  return 1e3 * (result.poses.X.translation() - scene.truth.X.translation()).norm();
}

class TargetSizes : public testing::TestWithParam<Setup> {};
INSTANTIATE_TEST_SUITE_P(HandEye, TargetSizes, testing::Values(Setup::eye_in_hand, Setup::eye_to_hand));

TEST_P(TargetSizes, PrintThatIsOffIsMeasuredAndNoLongerMovesTheCamera) {
  const HandEyeScene scene = scene_of(GetParam(), 1.015, 21);
  const Calibration result = calibrated(scene, TargetSize::automatic);
  ASSERT_TRUE(result.scale && result.scale->solved);
  EXPECT_NEAR(result.scale->estimate, 1.015, 4 * result.scale->sd);
  const Vector6d error = motion_between(result.poses.X, scene.truth.X);
  const Vector6d sd = result.covariance.diagonal().cwiseSqrt();
  EXPECT_TRUE((error.cwiseAbs().array() < 4 * sd.array()).all())
      << error.transpose() << " / " << sd.transpose();
  // As stated, every distance from the camera is short by 1.5 %.
  const double distance = scene.settings.distance * 1e3;
  EXPECT_GT(millimetres_off(calibrated(scene, TargetSize::stated), scene), 0.2 * 0.015 * distance);
  EXPECT_LT(millimetres_off(result, scene), 0.2 * 0.015 * distance);
  ASSERT_FALSE(result.warnings.empty());
  EXPECT_NE(result.warnings.front().find("times as large as stated"), std::string::npos);
}

TEST_P(TargetSizes, ValidationIsForTheSizeThatWasSolvedFor) {
  const HandEyeScene scene = scene_of(GetParam(), 1.015, 21);
  const Calibration result = calibrated(scene, TargetSize::automatic);
  const double scale = result.refined.bundle.scales.front();
  const ProjectionCheck check =
      check_projection(scene.settings.setup, result.poses, scene.camera, parse_target("chessboard:9x6:0.025"),
                       for_target_size(scene.observations, scale), scale);
  EXPECT_NEAR(check.corner_rms, result.chain_rms, 1e-9);  // the same sum, the other way round
}

TEST_P(TargetSizes, SizeThatIsRightStaysAsStated) {
  const HandEyeScene scene = scene_of(GetParam(), 1, 22);
  const Calibration result = calibrated(scene, TargetSize::automatic);
  ASSERT_TRUE(result.scale);
  EXPECT_FALSE(result.scale->solved);
  EXPECT_NEAR(result.scale->estimate, 1, 4 * result.scale->sd);
  EXPECT_EQ(result.refined.bundle.scales.front(), 1);
}

TEST_P(TargetSizes, WhatIsTooFarOffForAPrintIsNotTrusted) {
  const Calibration result = calibrated(scene_of(GetParam(), 1.13, 23), TargetSize::automatic);
  ASSERT_TRUE(result.scale);
  EXPECT_FALSE(result.scale->solved);
  EXPECT_FALSE(result.usable);
}

}  // namespace
}  // namespace flash::calib
