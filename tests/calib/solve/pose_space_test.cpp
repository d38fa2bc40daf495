#include "calib/solve/pose_space.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>

#include "tests/calib/hand_eye_scene.h"

namespace flash::calib {
namespace {

TEST(PoseSpace, StatedUncertaintyIsTrue) {
  constexpr int kTrials = 40;
  double chi_square = 0, rotation = 0, translation = 0;
  for (unsigned trial = 0; trial < kTrials; ++trial) {
    SceneSettings settings = protocol_settings(Setup::eye_to_hand);
    settings.corner_px = 0.001;
    settings.robot_deg = 0.2;
    settings.robot_mm = 1;
    const HandEyeScene scene = make_scene(settings, board_points(), 50 + trial);
    const PoseSpaceFit fit = fit_pose_space(loops_of(scene), park(loops_of(scene)));
    EXPECT_TRUE(fit.converged);
    const Vector6d error = motion_between(fit.poses.X, scene.truth.X);
    chi_square += error.dot(fit.covariance.topLeftCorner<6, 6>().ldlt().solve(error)) / kTrials;
    rotation += fit.rotation * 180 / M_PI / kTrials;
    translation += 1e3 * fit.translation / kTrials;
  }
  EXPECT_GT(chi_square, 4.4);  // 240 degrees of freedom over 40, 99.8 %
  EXPECT_LT(chi_square, 7.9);
  EXPECT_NEAR(rotation, 0.2, 0.01);
  // The target hangs 0.12 m from the gripper: a turn of 0.2 deg adds 0.4 mm across.
  EXPECT_NEAR(translation, 1.05, 0.12);
}

}  // namespace
}  // namespace flash::calib
