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

std::string all_of(const std::vector<std::string>& warnings) {
  std::string said;
  for (const std::string& warning : warnings) said += warning + '\n';
  return said;
}

// Four pictures that belong to the poses of others, of twenty.
TEST_P(MisfitViews, OfOtherPosesAreNotCalledThoseOfAnArmWhoseModelIsWrong) {
  SceneSettings settings = protocol_settings(GetParam());
  settings.views = 20;
  settings.robot_deg = 0.05;
  settings.robot_mm = 0.5;
  HandEyeScene scene = make_scene(settings, board_points(), 7331);
  const Eigen::Isometry3d first = scene.observations[3].T_base_gripper;
  for (const auto& [view, next] : {std::pair(3U, 8U), {8U, 12U}, {12U, 17U}})
    scene.observations[view].T_base_gripper = scene.observations[next].T_base_gripper;
  scene.observations[17].T_base_gripper = first;
  const std::string said = all_of(calibrated(scene).warnings);
  EXPECT_NE(said.find("4 views are off by more than any arm errs: their pictures belong to other poses"),
            std::string::npos)
      << said;
  EXPECT_EQ(said.find("model"), std::string::npos) << said;
}

TEST(MisfitSentence, SplitsWhatIsOffByMoreThanAnyArmErrsFromTheRest) {
  ViewSelection selection;
  selection.views.resize(20);
  for (ViewVerdict& view : selection.views) view.error = {0.001, 0.001};
  const auto leave_out = [&](std::size_t view, double rotation, double translation) {
    selection.views[view].used = false;
    selection.views[view].misfit = true;
    selection.views[view].error = {rotation, translation};
  };
  leave_out(0, 0.001, 0.004);
  EXPECT_EQ(misfit_sentence(selection), "");  // one slip in twenty
  leave_out(1, 0.002, 0.004);
  leave_out(2, 0.002, 0.003);
  EXPECT_TRUE(misfit_sentence(selection).starts_with("3 views are off by little"))
      << misfit_sentence(selection);
  leave_out(3, 0.5, 0.001);
  leave_out(4, 0.001, 0.2);
  const std::string both = misfit_sentence(selection);
  EXPECT_TRUE(both.starts_with("2 views are off by more than any arm errs")) << both;
  EXPECT_NE(both.find("; 3 views are off by little"), std::string::npos) << both;
}

}  // namespace
}  // namespace flash::calib
