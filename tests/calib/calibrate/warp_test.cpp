// Boards that are not flat, over draws of noise: whether the truth lies in the stated region.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "calib/calibrate/calibrate.h"
#include "tests/calib/hand_eye_scene.h"

namespace flash::calib {
namespace {

struct Shape {
  const char* name;
  Eigen::Vector3d warp;  ///< [m]
};

class Warped : public testing::TestWithParam<Shape> {};
INSTANTIATE_TEST_SUITE_P(Boards, Warped,
                         testing::Values(Shape{"Flat", {0, 0, 0}}, Shape{"Twisted", {0, 0, 5e-4}},
                                         // z = a (x + y)^2 on a square: half a bend each way, and a twist
                                         Shape{"BentAlongTheDiagonal", {-2.5e-4, -2.5e-4, 5e-4}}),
                         [](const auto& test) { return test.param.name; });

TEST_P(Warped, HoldTheTruthInTheirRegion) {
  constexpr unsigned kDraws = 100;
  constexpr double kChiSquare95 = 12.592;
  SceneSettings settings = protocol_settings(Setup::eye_in_hand);
  settings.views = 8;
  settings.corner_px = 0.03;
  settings.robot_deg = 0.05;
  settings.robot_mm = 0.5;
  CalibrateSettings calibrate_settings;
  calibrate_settings.folds = 2;
  const Eigen::Matrix3Xd flat = board_points();
  const Eigen::Matrix3Xd bent = shaped(flat, target_bows(flat), {.warp = GetParam().warp});
  unsigned inside = 0;
  double squares = 0;
  for (unsigned draw = 0; draw < kDraws; ++draw) {
    HandEyeScene scene = make_scene(settings, bent, 47001 + draw);
    scene.points = flat;
    for (Observation& o : scene.observations)
      o.T_camera_target = {fitted_pose(scene.camera, flat, o.pixels, o.T_camera_target.front())};
    const Calibration result = calibrate(Setup::eye_in_hand, scene.camera, flat, grid_symmetries(flat),
                                         scene.observations, calibrate_settings);
    const Vector6d error = motion_between(result.poses.X, scene.truth.X);
    inside += error.dot(result.covariance.ldlt().solve(error)) < kChiSquare95;
    squares += ((result.warp.estimate - GetParam().warp).array() / result.warp.sd.array()).square().sum();
  }
  // 0.95 less three standard deviations of a hundred draws: sqrt(0.95 0.05 / 100) = 0.022.
  EXPECT_GE(inside, 0.885 * kDraws);
  RecordProperty("inside", static_cast<int>(inside));
  // The warp's errors over what is stated: 300 numbers, of which those of one draw go together; chi2 / 300 as
  // of a hundred free ones lies in 0.6 to 1.5 (99.9 %).
  EXPECT_GT(squares / (3 * kDraws), 0.6);
  EXPECT_LT(squares / (3 * kDraws), 1.5);
}

}  // namespace
}  // namespace flash::calib
