#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>

#include "calib/calibrate/calibrate.h"
#include "calib/calibrate/calibrate_pairs.h"
#include "calib/calibrate/extrinsics.h"
#include "data/numbers/chi_square.h"
#include "tests/calib/four_axis_scene.h"
#include "tests/data/temporary_folder.h"

namespace flash::calib {
namespace {

struct Case {
  Setup setup = Setup::eye_in_hand;
  bool pairs = false;
};

class FourAxes : public testing::TestWithParam<Case> {
 protected:
  FourAxisSettings scene_settings() const { return {.setup = GetParam().setup}; }

  Calibration solved(const HandEyeScene& scene, const std::optional<MeasuredHeight>& height = {}) const {
    CalibrateSettings settings;
    settings.folds = 3;
    settings.height = height;
    if (GetParam().pairs) return calibrate_pairs(scene.settings.setup, pairs_of(scene), settings);
    return calibrate(scene.settings.setup, scene.camera, scene.points, grid_symmetries(scene.points),
                     scene.observations, settings);
  }
};

/// The error of the camera along and about the axes of its parent.
Vector6d error_in_parent(const Calibration& result, const HandEyeScene& scene) {
  Vector6d error = motion_between(scene.truth.X, result.poses.X);
  error.head<3>() = (scene.truth.X.linear() * error.head<3>()).eval();
  error.tail<3>() = (scene.truth.X.linear() * error.tail<3>()).eval();
  return error;
}

bool warns(const Calibration& result, const std::string& words) {
  return std::any_of(result.warnings.begin(), result.warnings.end(),
                     [&](const std::string& warning) { return warning.find(words) != std::string::npos; });
}

// Six draws of five numbers: 30, of which 95 % less three standard deviations, sqrt(0.95 0.05 / 30), are 25.
TEST_P(FourAxes, AllButThePlaceAlongTheAxisIsToldWithDeviations) {
  int inside = 0;
  for (unsigned seed = 1; seed <= 6; ++seed) {
    const HandEyeScene scene = make_four_axis_scene(scene_settings(), seed);
    const Calibration result = solved(scene);
    EXPECT_TRUE(result.usable) << result.warnings.front();
    ASSERT_TRUE(result.along);
    EXPECT_FALSE(result.along->told);
    EXPECT_NE(result.warnings.front().find("is not told"), std::string::npos) << result.warnings.front();
    const Vector6d error = error_in_parent(result, scene);
    const ToldDeviations sd = told_deviations(result, result.covariance, Axes::parent);
    EXPECT_FALSE(sd[2]);
    for (const std::size_t i : {0U, 1U, 3U, 4U, 5U}) {
      ASSERT_TRUE(sd[i]);
      inside += std::abs(error[static_cast<Eigen::Index>(i)]) < 1.96 * *sd[i];
    }
    // It stands in the covariance as 10 m.
    const Vector6d untold = untold_direction(result.along->axis, result.poses.X);
    EXPECT_NEAR(std::sqrt(untold.dot(result.covariance * untold)), kUntoldSd, 0.01);
  }
  EXPECT_GE(inside, 25);
}

// The height that was measured holds, with its deviation: of the target it comes on top of what the distance
// is known to.
TEST_P(FourAxes, MeasuredHeightMakesTheAnswerWhole) {
  for (const bool target : {false, true}) {
    const HandEyeScene scene = make_four_axis_scene(scene_settings(), 21);
    const MeasuredHeight height{
        .target = target, .height = (target ? scene.truth.Z : scene.truth.X).translation().z(), .sd = 5e-4};
    const Calibration result = solved(scene, height);
    ASSERT_TRUE(result.along);
    EXPECT_TRUE(result.along->told);
    EXPECT_FALSE(warns(result, "not told"));
    const Vector6d error = motion_between(scene.truth.X, result.poses.X);
    EXPECT_LT(error.dot(result.covariance.ldlt().solve(error)), data::chi_square_999_of_6);
    const ToldDeviations sd = told_deviations(result, result.covariance, Axes::parent);
    ASSERT_TRUE(sd[2]);
    EXPECT_GE(*sd[2], 0.99 * height.sd);
  }
}

// The told numbers of a recording are those of one that holds it and tilted views, to the deviations of both.
TEST_P(FourAxes, TiltedViewsTellTheRestAndChangeNothingElse) {
  HandEyeScene scene = make_four_axis_scene(scene_settings(), 31);
  const Calibration partial = solved(scene);
  FourAxisSettings tilted = scene_settings();
  tilted.tilt_deg = 15;
  // The same seed makes the same mounts.
  const HandEyeScene more = make_four_axis_scene(tilted, 31);
  scene.observations.insert(scene.observations.end(), more.observations.begin(), more.observations.end());
  const Calibration whole = solved(scene);
  EXPECT_TRUE(!whole.along || whole.along->told);
  EXPECT_FALSE(partial.along->told);
  Vector6d apart = motion_between(partial.poses.X, whole.poses.X);
  EXPECT_LT(apart.dot(partial.covariance.ldlt().solve(apart)), 20.5);  // 99.9 % of chi-square, 5
}

TEST_P(FourAxes, AxisNeedNotBeTheVertical) {
  FourAxisSettings settings = scene_settings();
  settings.mount = rotation_exp({0.9, 0.3, 0});
  const HandEyeScene scene = make_four_axis_scene(settings, 41);
  const Calibration result = solved(scene);
  ASSERT_TRUE(result.along);
  EXPECT_FALSE(result.along->told);
  const Vector6d error = motion_between(scene.truth.X, result.poses.X);
  EXPECT_LT(error.dot(result.covariance.ldlt().solve(error)), 20.5);  // of chi-square, 5
}

// Tilts that grow from none tell the place better and better, and never wrongly.
TEST_P(FourAxes, SmallTiltsTellThePlaceWidely) {
  double last = kUntoldSd;
  for (const double tilt : {0.0, 0.3, 1.0, 3.0}) {
    FourAxisSettings settings = scene_settings();
    settings.tilt_deg = tilt;
    const HandEyeScene scene = make_four_axis_scene(settings, 51);
    const Calibration result = solved(scene);
    const Vector6d untold = untold_direction(result.along->axis, result.poses.X);
    const double sd = std::sqrt(untold.dot(result.covariance * untold));
    EXPECT_LE(sd, 1.01 * last) << tilt;
    last = sd;
    const Vector6d error = motion_between(scene.truth.X, result.poses.X);
    EXPECT_LT(error.dot(result.covariance.ldlt().solve(error)), data::chi_square_999_of_6) << tilt;
  }
  EXPECT_LT(last, 0.02);
}

TEST_P(FourAxes, HeightIsRefusedWhereTwoAxesTellIt) {
  HandEyeScene scene = protocol_scene(GetParam().setup, 0.05, 0.3, 61);
  EXPECT_NE(data::input_error_of([&] { solved(scene, MeasuredHeight{}); }).find("leave it out"),
            std::string::npos);
}

INSTANTIATE_TEST_SUITE_P(Setups, FourAxes,
                         testing::Values(Case{Setup::eye_in_hand, false}, Case{Setup::eye_to_hand, false},
                                         Case{Setup::eye_in_hand, true}, Case{Setup::eye_to_hand, true}),
                         [](const auto& tested) {
                           return std::string(tested.param.setup == Setup::eye_in_hand ? "EyeInHand"
                                                                                       : "EyeToHand") +
                                  (tested.param.pairs ? "Pairs" : "Pictures");
                         });

}  // namespace
}  // namespace flash::calib
