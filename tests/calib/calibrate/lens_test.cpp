#include <gtest/gtest.h>

#include "calib/calibrate/calibrate.h"
#include "tests/calib/arm_scene.h"

namespace flash::calib {
namespace {

/// A board through a lens with distortion, handed over with the lens that `stated` makes of it.
HandEyeScene scene_of(Setup setup, unsigned seed) {
  SceneSettings settings = protocol_settings(setup);
  settings.views = 20;
  settings.distance = 0.42;
  settings.spread = {0.08, 0.06, 0.10};
  settings.robot_deg = 0.05;
  settings.robot_mm = 0.3;
  HandEyeScene scene = make_scene(settings, board_points(), seed);
  scene.camera.model = data::DistortionModel::plumb_bob;
  scene.camera.distortion = {-0.2, 0.1, 0.001, -0.001, 0};
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  for (std::size_t i = 0; i < scene.observations.size(); ++i) {
    const Eigen::Isometry3d& pose = scene.true_poses[i];
    const Eigen::Isometry3d T = setup == Setup::eye_in_hand
                                    ? scene.truth.X.inverse() * pose.inverse() * scene.truth.Z
                                    : scene.truth.X.inverse() * pose * scene.truth.Z;
    for (Eigen::Index k = 0; k < scene.points.cols(); ++k)
      scene.observations[i].pixels.col(k) = project(to_vector(scene.camera), T * scene.points.col(k)) +
                                            0.1 * Eigen::Vector2d(normal(random), normal(random));
  }
  return scene;
}

Calibration calibrated(HandEyeScene scene, const data::CameraIntrinsics& stated,
                       const CalibrateSettings& settings = {}) {
  for (Observation& o : scene.observations)
    o.T_camera_target = {fitted_pose(stated, Eigen::Matrix3Xd(scene.points(Eigen::all, o.points)), o.pixels,
                                     o.T_camera_target.front())};
  return calibrate(scene.settings.setup, stated, scene.points, grid_symmetries(scene.points),
                   scene.observations, settings);
}

void expect_inside(const Calibration& result, const HandEyeScene& scene) {
  const Vector6d error = motion_between(result.poses.X, scene.truth.X);
  EXPECT_LT(error.dot(result.covariance.ldlt().solve(error)), 22.5);  // 99.9 % of chi-square, 6
}

void expect_found(const Calibration& result, const HandEyeScene& scene) {
  EXPECT_TRUE(result.usable);
  EXPECT_TRUE(result.warnings.front().starts_with("the lens is not as stated")) << result.warnings.front();
  const IntrinsicsVector off = result.lens.estimate - to_vector(scene.camera);
  // Five of 20 numbers beyond 4 of their deviations would be chance once in 10^9.
  EXPECT_LT(std::abs(off[0]), 4 * result.lens.sd[0]);
  EXPECT_LT(std::abs(off[1]), 4 * result.lens.sd[1]);
  EXPECT_LT(result.lens.sd[0], 0.01 * scene.camera.fx);
  expect_inside(result, scene);
}

class Lens : public testing::TestWithParam<Setup> {};
INSTANTIATE_TEST_SUITE_P(HandEye, Lens, testing::Values(Setup::eye_in_hand, Setup::eye_to_hand));

TEST_P(Lens, AsStatedIsNearAsStated) {
  const HandEyeScene scene = scene_of(GetParam(), 31);
  const Calibration result = calibrated(scene, scene.camera);
  EXPECT_TRUE(result.lens.far_off.empty());
  EXPECT_LT(std::abs(result.lens.estimate[0] - scene.camera.fx), 4 * result.lens.sd[0]);
  expect_inside(result, scene);
}

TEST_P(Lens, StatedToTheLastDigitIsKept) {
  const HandEyeScene scene = scene_of(GetParam(), 31);
  CalibrateSettings settings;
  settings.lens = LensKnowledge::stated;
  const Calibration result = calibrated(scene, scene.camera, settings);
  EXPECT_EQ(result.refined.bundle.intrinsics.front().fx, scene.camera.fx);
  EXPECT_EQ(result.lens.sd[0], 0);
}

TEST_P(Lens, FocalLengthFivePercentOffIsFoundAndSaid) {
  const HandEyeScene scene = scene_of(GetParam(), 32);
  data::CameraIntrinsics stated = scene.camera;
  stated.fx *= 1.05;
  stated.fy *= 1.05;
  const Calibration found = calibrated(scene, stated);
  expect_found(found, scene);
  // Each middle by its own lens: the view's pose explains its own corners, whatever lens was stated.
  EXPECT_LT(found.centre_rms, 1.2 * found.chain_rms);  // and what the pose adds by its own noise
}

// What the answer says of the stated lens, and an answer for that lens by itself.
TEST_P(Lens, HowFarOffTheStatedLensWouldPutTheCameraIsWhatARefitSays) {
  const HandEyeScene scene = scene_of(GetParam(), 36);
  data::CameraIntrinsics stated = scene.camera;
  stated.fx *= 1.004;
  stated.fy *= 1.004;
  stated.cx += 2;
  const Calibration found = calibrated(scene, stated);
  CalibrateSettings settings;
  settings.lens = LensKnowledge::stated;
  const Calibration kept = calibrated(scene, stated, settings);
  const Vector6d refit = motion_between(found.poses.X, kept.poses.X);
  EXPECT_GT(refit.head<3>().norm(), 5e-4);
  // The other answer starts at a seed of its own, and weighs the size of the target by what it finds of the
  // arm itself.
  EXPECT_LT((found.lens.camera_shift - refit).head<3>().norm(), 0.03 * refit.head<3>().norm());
  EXPECT_LT((found.lens.camera_shift - refit).tail<3>().norm(), 0.03 * refit.tail<3>().norm());
  EXPECT_EQ(kept.lens.camera_shift.norm(), 0);
}

TEST_P(Lens, DistortionThatIsMissingIsFoundAndSaid) {
  const HandEyeScene scene = scene_of(GetParam(), 33);
  data::CameraIntrinsics stated = scene.camera;
  stated.distortion = {0, 0, 0, 0, 0};
  expect_found(calibrated(scene, stated), scene);
}

// A lens that the file knows well, and one that it says it knows badly: the first holds the answer.
TEST_P(Lens, StatedCovarianceIsWhatIsKnown) {
  const HandEyeScene scene = scene_of(GetParam(), 34);
  LensCovariance known = LensCovariance::Zero();
  known.diagonal().head<kLensUnknowns>().setConstant(1e-8);
  CalibrateSettings settings;
  settings.lens_covariance = known;
  const Calibration firm = calibrated(scene, scene.camera, settings);
  EXPECT_NEAR(firm.lens.estimate[0], scene.camera.fx, 1e-3);  // ten of those deviations
  EXPECT_LE(firm.lens.sd[0], 1.1e-4);  // and what half of its first deviation adds to the tail
  const Calibration usual = calibrated(scene, scene.camera);
  EXPECT_LT(firm.covariance.trace(), usual.covariance.trace());
  data::CameraIntrinsics stated = scene.camera;
  stated.fx += 6;
  stated.fy += 6;
  settings.lens_covariance = LensCovariance::Zero();
  settings.lens_covariance.diagonal().head<2>().setConstant(36);
  const Calibration loose = calibrated(scene, stated, settings);
  EXPECT_TRUE(loose.lens.far_off.empty());
  expect_inside(loose, scene);
}

HandEyeScene warped(Setup setup, const Warp& warp, unsigned seed) {
  HandEyeScene scene = scene_of(setup, seed);
  const Eigen::Matrix3Xd bent = shaped(scene.points, target_bows(scene.points), {.warp = warp});
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  for (std::size_t i = 0; i < scene.observations.size(); ++i) {
    const Eigen::Isometry3d& pose = scene.true_poses[i];
    const Eigen::Isometry3d T =
        scene.truth.X.inverse() * (setup == Setup::eye_in_hand ? pose.inverse() : pose) * scene.truth.Z;
    for (Eigen::Index k = 0; k < bent.cols(); ++k)
      scene.observations[i].pixels.col(k) = project(to_vector(scene.camera), T * bent.col(k)) +
                                            0.1 * Eigen::Vector2d(normal(random), normal(random));
  }
  return scene;
}

TEST_P(Lens, BoardThatIsNotFlatIsMeasuredAndMovesNothing) {
  for (const Warp& warp : {Warp(8e-4, 0, 0), Warp(0, 0, 8e-4)}) {
    const HandEyeScene scene = warped(GetParam(), warp, 35);
    const Calibration result = calibrated(scene, scene.camera);
    for (int i = 0; i < kWarp; ++i) EXPECT_NEAR(result.warp.estimate[i], warp[i], 4 * result.warp.sd[i]) << i;
    EXPECT_LT(result.warp.sd.maxCoeff(), 1e-4);
    EXPECT_NEAR(result.refined.noise.corner.front(), 0.1, 0.01);  // 2,000 numbers tell it to 2 %
    expect_inside(result, scene);
  }
}

TEST(MeanDifference, IsThatOfPairs) {
  const MeanDifference d = mean_difference({1, 2, 6}, {0, 0, 0});
  EXPECT_DOUBLE_EQ(d.mean, 3);
  EXPECT_DOUBLE_EQ(d.sd, std::sqrt((4 + 1 + 9) / 6.0));
}

}  // namespace
}  // namespace flash::calib
