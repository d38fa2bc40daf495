// A camera or a target that moves while it is recorded.
#include <gtest/gtest.h>

#include "calib/calibrate/calibrate.h"
#include "tests/calib/arm_scene.h"
#include "tests/calib/knocked_scene.h"

namespace flash::calib {
namespace {

HandEyeScene scene_of(Setup setup, unsigned seed) {
  SceneSettings settings = protocol_settings(setup);
  settings.views = 20;
  settings.distance = 0.42;
  settings.spread = {0.05, 0.035, 0.10};
  settings.robot_deg = 0.05;
  settings.robot_mm = 0.5;
  return make_scene(settings, board_points(), seed);
}

Calibration calibrated(const HandEyeScene& scene) {
  return calibrate(scene.settings.setup, scene.camera, scene.points, grid_symmetries(scene.points),
                   scene.observations);
}

/// From a view on the camera or the target has moved by `motion`, in its own frame.
void knock(HandEyeScene& scene, std::size_t first, bool camera, const Vector6d& motion) {
  displace(scene, first, scene.observations.size(), camera, motion, 9);
}

struct Case {
  Setup setup;
  bool camera;
};
class Knocks : public testing::TestWithParam<Case> {};
INSTANTIATE_TEST_SUITE_P(HandEye, Knocks,
                         testing::Values(Case{Setup::eye_in_hand, true}, Case{Setup::eye_in_hand, false},
                                         Case{Setup::eye_to_hand, true}, Case{Setup::eye_to_hand, false}));

TEST_P(Knocks, EightMillimetresHalfWayAreFoundByTheirTimeAndBothPartsSolved) {
  const auto& [setup, camera] = GetParam();
  HandEyeScene scene = scene_of(setup, 5);
  Vector6d motion = Vector6d::Zero();
  motion.head<3>() << 0.006, -0.004, 0.0035;  // 8 mm
  knock(scene, 10, camera, motion);
  const Calibration result = calibrated(scene);
  ASSERT_TRUE(result.other_part);
  const KnockedPart& other = *result.other_part;
  EXPECT_EQ(other.view, "10");
  EXPECT_EQ(other.knock.camera, camera);
  EXPECT_TRUE(other.knock.told);  // views turn by 45 deg: only one of them explains both parts
  // A robot of 0.5 mm and 0.05 deg at 0.4 m, ten views: 0.2 mm an axis, known to four of them.
  EXPECT_LT((other.knock.motion.head<3>() - motion.head<3>()).norm(), 2e-3);
  EXPECT_TRUE(other.before);
  EXPECT_EQ(other.views, 10);
  EXPECT_EQ(result.used.size(), 10U);
  const Eigen::Isometry3d now = camera ? moved(scene.truth.X, motion) : scene.truth.X;
  const Vector6d error = motion_between(result.poses.X, now);
  EXPECT_LT(error.dot(result.covariance.ldlt().solve(error)), 22.5);  // 99.9 % of chi-square, 6
  ASSERT_TRUE(other.poses);
  EXPECT_LT((other.poses->X.translation() - scene.truth.X.translation()).norm(), 3e-3);
  EXPECT_NE(result.warnings.front().find(camera ? "the camera moved by" : "the target moved by"),
            std::string::npos)
      << result.warnings.front();
  EXPECT_NE(result.views[3].reason.find("the knock at 10"), std::string::npos);
}

TEST_P(Knocks, TheSecondOfTwoCounts) {
  const auto& [setup, camera] = GetParam();
  HandEyeScene scene = scene_of(setup, 5);
  Vector6d motion = Vector6d::Zero();
  motion.head<3>() << 0.012, -0.008, 0.007;  // 16 mm, twice
  knock(scene, 7, camera, motion);
  knock(scene, 14, camera, -motion.cwiseAbs());
  const Calibration result = calibrated(scene);
  ASSERT_TRUE(result.other_part);
  ASSERT_EQ(result.used.front(), 14);
  const Eigen::Isometry3d now = camera ? moved(scene.truth.X, -motion.cwiseAbs()) : scene.truth.X;
  const Vector6d error = motion_between(result.poses.X, now);
  EXPECT_LT(error.dot(result.covariance.ldlt().solve(error)), 22.5);  // 99.9 % of chi-square, 6
}

TEST_P(Knocks, BeforeTheLastViewsLeaveTheCameraUnknown) {
  const auto& [setup, camera] = GetParam();
  HandEyeScene scene = scene_of(setup, 5);
  Vector6d motion = Vector6d::Zero();
  motion.head<3>() << 0.009, -0.006, 0.0052;  // 12 mm
  knock(scene, 15, camera, motion);
  const Calibration result = calibrated(scene);
  if (!result.other_part) {  // they were left out one by one
    EXPECT_FALSE(result.usable);
    EXPECT_EQ(result.warnings.front().substr(0, 16), "the last 5 views");
    return;
  }
  EXPECT_FALSE(result.other_part->before);
  EXPECT_EQ(result.other_part->view, "15");
  EXPECT_EQ(result.usable, !camera && result.other_part->knock.told);
}

// Ten millimetres before the last or after the first two to four views. The answer is of most views: where
// the camera is now is not known if it, or one of the two, was knocked before the last ones.
TEST_P(Knocks, WithFewViewsOnOneSideAreTold) {
  const auto& [setup, camera] = GetParam();
  Vector6d motion = Vector6d::Zero();
  motion.head<3>() << 0.0075, -0.005, 0.00433;  // 10 mm
  for (const std::size_t views : {2U, 3U, 4U})
    for (const bool last : {true, false}) {
      HandEyeScene scene = scene_of(setup, 7200 + static_cast<unsigned>(views));
      const std::size_t count = scene.observations.size();
      displace(scene, last ? count - views : 0, last ? count : views, camera, motion, 9);
      const Calibration result = calibrated(scene);
      ASSERT_TRUE(result.other_part) << views << last;
      const KnockedPart& other = *result.other_part;
      EXPECT_EQ(other.before, !last);
      EXPECT_EQ(other.view, std::to_string(last ? count - views : views));
      EXPECT_EQ(other.views, static_cast<int>(views));
      EXPECT_EQ(result.usable, !last || (other.knock.told && !other.knock.camera));
      EXPECT_TRUE(!other.knock.told || other.knock.camera == camera);
      const Vector6d error = motion_between(result.poses.X, scene.truth.X);
      EXPECT_LT(error.dot(result.covariance.ldlt().solve(error)), 22.5);  // 99.9 % of chi-square, 6
    }
}

TEST_P(Knocks, BeforeTheLastViewAreToldToBeThatOrAWrongPose) {
  const auto& [setup, camera] = GetParam();
  HandEyeScene scene = scene_of(setup, 7271);
  Vector6d motion = Vector6d::Zero();
  motion.head<3>() << 0.0075, -0.005, 0.00433;  // 10 mm
  displace(scene, 19, 20, camera, motion, 9);
  const Calibration result = calibrated(scene);
  EXPECT_EQ(result.used.size(), 19U);
  EXPECT_TRUE(result.usable);
  EXPECT_TRUE(result.warnings.front().starts_with("the last view does not close with those before"))
      << result.warnings.front();
}

TEST_P(Knocks, AreNotSeenWhereThereAreNone) {
  // One in twenty is the prior; of 12 recordings, half of arms with wrong kinematics, none is likelier than
  // not.
  for (unsigned seed = 201; seed < 204; ++seed) {
    const Calibration still = calibrated(scene_of(GetParam().setup, seed));
    EXPECT_FALSE(still.other_part || still.drift) << seed;
    SceneSettings settings = protocol_settings(GetParam().setup);
    settings.views = 20;
    settings.robot_deg = 0.005;
    settings.robot_mm = 0.03;
    const HandEyeScene arm =
        make_arm_scene(settings, {.zero_deg = 0.1, .length_mm = 0.5}, 0.4, board_points(), seed);
    const Calibration wrong = calibrated(arm);
    EXPECT_FALSE(wrong.other_part || wrong.drift) << seed;
  }
}

}  // namespace
}  // namespace flash::calib
