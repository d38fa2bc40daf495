#include "calib/calibrate/next_poses.h"

#include <gtest/gtest.h>

#include <cmath>

#include "data/files/error.h"
#include "tests/calib/hand_eye_scene.h"

namespace flash::calib {
namespace {

TEST(Plan, AddedViewsLowerTheUncertaintyAsPredicted) {
  SceneSettings settings = protocol_settings(Setup::eye_in_hand);
  settings.views = 8;
  settings.robot_deg = 0.1;
  settings.robot_mm = 1;
  const HandEyeScene scene = make_scene(settings, board_points(), 3);
  const Calibration result = calibrate(Setup::eye_in_hand, scene.camera, scene.points,
                                       grid_symmetries(scene.points), scene.observations);
  PlanSettings wanted;
  wanted.poses = 4;
  wanted.candidates = 400;
  wanted.upper.z() = 1.0;
  const Plan plan = plan_poses(result, scene.points, wanted);
  ASSERT_EQ(plan.poses.size(), 4U);
  double before = plan.translation_sd;
  for (const PlannedPose& pose : plan.poses) {
    EXPECT_LE(pose.translation_sd, before + 1e-12);
    EXPECT_LE(pose.T_base_gripper.translation().z(), 1.0);
    before = pose.translation_sd;
  }
  // Chosen views do better than as many again of the same kind: sqrt(8 / 12).
  EXPECT_LT(before, std::sqrt(8.0 / 12) * plan.translation_sd);
  wanted.lower.z() = 1.0;
  wanted.upper.z() = 0.9;
  EXPECT_THROW(plan_poses(result, scene.points, wanted), data::InputError);
}

}  // namespace
}  // namespace flash::calib
