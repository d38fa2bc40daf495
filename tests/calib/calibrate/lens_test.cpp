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

Calibration calibrated(HandEyeScene scene, const data::CameraIntrinsics& stated) {
  for (Observation& o : scene.observations)
    o.T_camera_target = {fitted_pose(stated, Eigen::Matrix3Xd(scene.points(Eigen::all, o.points)), o.pixels,
                                     o.T_camera_target.front())};
  return calibrate(scene.settings.setup, stated, scene.points, grid_symmetries(scene.points),
                   scene.observations);
}

void expect_found(const Calibration& result, const HandEyeScene& scene) {
  EXPECT_TRUE(result.lens_found);
  EXPECT_TRUE(result.usable);
  EXPECT_TRUE(result.warnings.front().starts_with("the lens is not as stated")) << result.warnings.front();
  // Tilted boards over the whole picture tell a focal length to about 0.2 %.
  EXPECT_NEAR(result.refined.bundle.intrinsics.front().fx, scene.camera.fx, 0.01 * scene.camera.fx);
  const Vector6d error = motion_between(result.poses.X, scene.truth.X);
  EXPECT_LT(error.dot(result.covariance.ldlt().solve(error)), 22.5);  // 99.9 % of chi-square, 6
}

class Lens : public testing::TestWithParam<Setup> {};
INSTANTIATE_TEST_SUITE_P(HandEye, Lens, testing::Values(Setup::eye_in_hand, Setup::eye_to_hand));

TEST_P(Lens, AsStatedStaysAsStated) {
  const HandEyeScene scene = scene_of(GetParam(), 31);
  const Calibration result = calibrated(scene, scene.camera);
  EXPECT_FALSE(result.lens_found);
  EXPECT_EQ(result.refined.bundle.intrinsics.front().fx, scene.camera.fx);
}

TEST_P(Lens, FocalLengthFivePercentOffIsFoundAndSaid) {
  const HandEyeScene scene = scene_of(GetParam(), 32);
  data::CameraIntrinsics stated = scene.camera;
  stated.fx *= 1.05;
  stated.fy *= 1.05;
  expect_found(calibrated(scene, stated), scene);
}

TEST_P(Lens, DistortionThatIsMissingIsFoundAndSaid) {
  const HandEyeScene scene = scene_of(GetParam(), 33);
  data::CameraIntrinsics stated = scene.camera;
  stated.distortion = {0, 0, 0, 0, 0};
  expect_found(calibrated(scene, stated), scene);
}

TEST(MeanDifference, IsThatOfPairs) {
  const MeanDifference d = mean_difference({1, 2, 6}, {0, 0, 0});
  EXPECT_DOUBLE_EQ(d.mean, 3);
  EXPECT_DOUBLE_EQ(d.sd, std::sqrt((4 + 1 + 9) / 6.0));
}

}  // namespace
}  // namespace flash::calib
