// Views that are as good as the others stay, and those that are wrong do not.
#include "calib/calibrate/misfit_views.h"

#include <gtest/gtest.h>

#include "tests/calib/arm_scene.h"

namespace flash::calib {
namespace {

class MisfitViews : public testing::TestWithParam<Setup> {};
INSTANTIATE_TEST_SUITE_P(HandEye, MisfitViews, testing::Values(Setup::eye_in_hand, Setup::eye_to_hand));

Calibration calibrated(const HandEyeScene& scene) {
  CalibrateSettings settings;
  settings.folds = 2;
  return calibrate(scene.settings.setup, scene.camera, scene.points, grid_symmetries(scene.points),
                   scene.observations, settings);
}

// Chance alone leaves one out in 200 recordings; of 16 more than one in 6,000 times.
TEST_P(MisfitViews, AreNoneOfThoseThatAreAsGoodAsTheOthers) {
  int views = 0, used = 0;
  for (unsigned seed = 7301; seed < 7317; ++seed) {
    const HandEyeScene scene = protocol_scene(GetParam(), 0.05, 0.5, seed);
    used += static_cast<int>(calibrated(scene).used.size());
    views += scene.settings.views;
  }
  EXPECT_GE(used, views - 1);
}

// Poses off by ten times the robot's noise, at three places far apart: none of them is used.
TEST_P(MisfitViews, AreThoseThatAreWrong) {
  for (unsigned seed = 7321; seed < 7327; ++seed) {
    HandEyeScene scene = protocol_scene(GetParam(), 0.05, 0.5, seed);
    Vector6d wrong;
    wrong << 0.004, -0.003, 0.004, 0.008, 0.006, -0.009;
    for (const std::size_t view : {2U, 7U, 12U}) {
      Eigen::Isometry3d& pose = scene.observations[view].T_base_gripper;
      pose = moved(pose, view == 7 ? -wrong : Vector6d(wrong.reverse() * 0.6 + wrong * 0.6));
    }
    const Calibration result = calibrated(scene);
    for (const std::size_t view : {2U, 7U, 12U}) EXPECT_FALSE(result.views[view].used) << seed << " " << view;
    EXPECT_EQ(result.used.size(), scene.observations.size() - 3) << seed;
  }
}

}  // namespace
}  // namespace flash::calib
