#include "calib/solve/held_out.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/calib/hand_eye_scene.h"

namespace flash::calib {
namespace {

TEST(HeldOut, ViewsShowTheNoiseOfTheRobot) {
  SceneSettings settings = protocol_settings(Setup::eye_in_hand);
  settings.views = 40;
  settings.robot_deg = 0.1;
  settings.robot_mm = 1;
  const HandEyeScene scene = make_scene(settings, board_points(), 6);
  const Refinement refined = refine(seeded_bundle(scene));
  std::vector<Eigen::Isometry3d> poses;
  for (const Observation& observation : scene.observations)
    poses.push_back(observation.T_camera_target.front());
  RefineSettings again;
  again.noise = refined.noise;
  const HeldOut held = hold_out(refined.bundle, poses, Method::errors_in_variables, again);
  EXPECT_NEAR(held.deg, std::sqrt(3.0) * 0.1, 0.05);  // three axes; 120 numbers: 7 %, and the fit's own part
  // Seen from 0.42 m: 1 mm an axis and the lever of 0.1 deg, 0.5 m away.
  EXPECT_NEAR(held.mm, std::sqrt(3.0 + 2 * std::pow(0.1 * M_PI / 180 * 500, 2)), 0.5);
  EXPECT_GT(held.px, 10 * reprojection_rms(refined.bundle));
}

}  // namespace
}  // namespace flash::calib
