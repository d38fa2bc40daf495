#include "calib/geometry/closed_form.h"

#include <gtest/gtest.h>

#include "tests/calib/hand_eye_scene.h"

namespace flash::calib {
namespace {

class ClosedForms : public testing::TestWithParam<Setup> {};
INSTANTIATE_TEST_SUITE_P(HandEye, ClosedForms, testing::Values(Setup::eye_in_hand, Setup::eye_to_hand));

TEST_P(ClosedForms, AreExactWithoutNoise) {
  SceneSettings settings = protocol_settings(GetParam());
  settings.corner_px = 0;
  const HandEyeScene scene = make_scene(settings, protocol_points(GetParam()), 1);
  for (const HandEyePoses& poses : {park(loops_of(scene)), shah(loops_of(scene))}) {
    // What remains is the rounding of the poses fitted to the pixels.
    EXPECT_LT(motion_between(poses.X, scene.truth.X).norm(), 1e-9);
    EXPECT_LT(motion_between(poses.Z, scene.truth.Z).norm(), 1e-9);
  }
  std::vector<PoseLoop> loops = loops_of(scene);
  for (PoseLoop& loop : loops) loop.C.translation() /= 1.04;
  EXPECT_NEAR(translation_scale(loops, park(loops)), 1.04, 1e-9);
}

}  // namespace
}  // namespace flash::calib
