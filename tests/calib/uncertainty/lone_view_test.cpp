#include "calib/uncertainty/lone_view.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>

#include "calib/calibrate/calibrate.h"
#include "tests/calib/hand_eye_scene.h"

namespace flash::calib {
namespace {

class LoneViews : public testing::TestWithParam<Setup> {};
INSTANTIATE_TEST_SUITE_P(HandEye, LoneViews, testing::Values(Setup::eye_in_hand, Setup::eye_to_hand));

Calibration calibrated(const HandEyeScene& scene) {
  return calibrate(scene.settings.setup, scene.camera, scene.points, grid_symmetries(scene.points),
                   scene.observations);
}

bool tells(const Calibration& result, const std::string& beginning) {
  return std::any_of(result.warnings.begin(), result.warnings.end(),
                     [&](const std::string& warning) { return warning.starts_with(beginning); });
}

// Fourteen views that turn about one axis alone, within half a degree, and one that tilts: all that is known
// of the other axes is from that one. The answer is right all the same.
TEST_P(LoneViews, AreToldAndTheAnswerStands) {
  SceneSettings settings = protocol_settings(GetParam());
  settings.views = 15;
  settings.robot_deg = 0.05;
  settings.robot_mm = 0.5;
  const HandEyeScene tilted = make_scene(settings, board_points(), 41);
  settings.tilt_deg = 0.5;
  HandEyeScene scene = make_scene(settings, board_points(), 41);  // with the same truth
  scene.observations[7] = tilted.observations[7];
  const Calibration result = calibrated(scene);
  EXPECT_TRUE(result.usable) << result.warnings.front();
  EXPECT_TRUE(tells(result, "the answer hangs on 7:"));
  const Vector6d error = motion_between(result.poses.X, scene.truth.X);
  EXPECT_LT(error.dot(result.covariance.ldlt().solve(error)), 22.5);  // 99.9 % of chi-square, 6
}

TEST_P(LoneViews, AreNoneOfThoseThatAreLikeOthers) {
  EXPECT_FALSE(tells(calibrated(protocol_scene(GetParam(), 0.05, 0.5, 42)), "the answer hangs on"));
}

}  // namespace
}  // namespace flash::calib
