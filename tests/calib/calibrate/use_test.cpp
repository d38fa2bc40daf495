#include "calib/calibrate/use.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "calib/calibrate/calibrate.h"
#include "tests/calib/arm_scene.h"

namespace flash::calib {
namespace {

Calibration solved(const HandEyeScene& scene, Use use) {
  CalibrateSettings settings;
  settings.use = use;
  return calibrate(scene.settings.setup, scene.camera, scene.points, grid_symmetries(scene.points),
                   scene.observations, settings);
}

HandEyeScene arm_scene(unsigned seed) {
  SceneSettings settings = protocol_settings(Setup::eye_in_hand);
  settings.views = 20;
  settings.robot_deg = 0.005;
  settings.robot_mm = 0.03;
  return make_arm_scene(settings, {.zero_deg = 0.1, .length_mm = 0.5}, 0.4, board_points(), seed);
}

TEST(Use, ImageTakesTheFewestPixelsWhereTheyPredictBetterByTwoStandardErrors) {
  for (const unsigned seed : {41U, 42U}) {
    const HandEyeScene scene = arm_scene(seed);
    const Calibration image = solved(scene, Use::image), workspace = solved(scene, Use::workspace);
    EXPECT_LE(image.held_out.px, workspace.held_out.px);  // the same, or fewer
    EXPECT_EQ(image.use.value, image.held_out.px);
    EXPECT_EQ(workspace.use.value, workspace.held_out.mm);
    EXPECT_EQ(image.comparison.back().name, to_string(image.method));
    EXPECT_TRUE(image.poses.X.isApprox(image.comparison.back().poses.X, 0));
    const bool fewest = image.method == Method::pixels;
    const ComparedMethod &last = image.comparison.back(), &other = image.comparison.end()[-2];
    const MeanDifference more = mean_difference(means_of_folds(*(fewest ? other : last).held_out, 0),
                                                means_of_folds(*(fewest ? last : other).held_out, 0));
    EXPECT_EQ(fewest, more.mean > 2 * more.sd);
  }
}

TEST(Use, TwoArmsTakeTheLensAsStatedAndSolveForThePrint) {
  const HandEyeScene scene = arm_scene(45);
  const Calibration result = solved(scene, Use::two_arms);
  EXPECT_EQ(to_vector(result.refined.bundle.intrinsics.front()), to_vector(scene.camera));
  EXPECT_TRUE(result.unknowns.scales);
  EXPECT_EQ(result.size->prior_sd, usual_size_sd(scene.points));
  ASSERT_TRUE(result.use.value);
  EXPECT_GT(*result.use.value, 0);
  for (const ComparedMethod& method : result.comparison)
    EXPECT_EQ(method.halves.has_value(), method.held_out.has_value());
}

/// The scene with a lens that is stated `off` times too long and with its centre `shift` px beside.
HandEyeScene misstated(HandEyeScene scene, double off, double shift) {
  scene.camera.fx *= off;
  scene.camera.fy *= off;
  scene.camera.cx += shift;
  for (Observation& o : scene.observations)
    o.T_camera_target = {fitted_pose(scene.camera, scene.points, o.pixels, o.T_camera_target.front())};
  return scene;
}

// Two arms keep a lens that is off by what lenses usually are: what it may do to the camera's place is
// stated.
TEST(Use, TwoArmsStateWhatTheLensTheyKeepMayBeOff) {
  constexpr double kChiSquare999 = 22.458;  // six degrees of freedom
  SceneSettings settings = protocol_settings(Setup::eye_in_hand);
  settings.robot_deg = 0.03;
  settings.robot_mm = 0.3;
  for (const unsigned seed : {71U, 72U, 73U, 74U}) {
    const HandEyeScene scene = misstated(make_scene(settings, board_points(), seed), 1.005, 3);
    const Calibration result = solved(scene, Use::two_arms);
    const Vector6d error = motion_between(result.poses.X, scene.truth.X);
    EXPECT_LT(error.dot(result.covariance.ldlt().solve(error)), kChiSquare999) << seed;
  }
  const Calibration far = solved(misstated(make_scene(settings, board_points(), 75), 1.05, 0), Use::two_arms);
  std::string said;
  for (const std::string& warning : far.warnings) said += warning + '\n';
  EXPECT_NE(said.find("the lens is not as stated"), std::string::npos) << said;
}

TEST(Use, TwoArmsWithPrintsOfTheirOwnAreNearerThanWithPrintsAsStated) {
  // Two standard deviations of a print, one either way, a metre away: 12 mm between the arms.
  const Eigen::Matrix3Xd points = board_points(7, 5, 0.03);
  std::vector<Eigen::Isometry3d> truth, with_prior, as_stated;
  for (const double size : {1 + 2 * kPrintSd, 1 - 2 * kPrintSd}) {
    SceneSettings settings = protocol_settings(Setup::eye_to_hand);
    settings.robot_deg = 0.05;
    settings.robot_mm = 0.5;
    HandEyeScene scene = make_scene(settings, size * points, size > 1 ? 47 : 48);
    scene.points = points;
    for (Observation& o : scene.observations)
      o.T_camera_target = {fitted_pose(scene.camera, points, o.pixels, o.T_camera_target.front())};
    truth.push_back(scene.truth.X);
    with_prior.push_back(solved(scene, Use::two_arms).poses.X);
    CalibrateSettings stated;
    stated.use = Use::two_arms;
    stated.target_size_sd = 0;
    as_stated.push_back(
        calibrate(settings.setup, scene.camera, points, grid_symmetries(points), scene.observations, stated)
            .poses.X);
  }
  const Eigen::Vector3d middle = truth[1] * Eigen::Vector3d(0, 0, 0.9);
  const auto off = [&](const std::vector<Eigen::Isometry3d>& X) {
    return (X[0] * (X[1].inverse() * middle) - truth[0] * (truth[1].inverse() * middle)).norm();
  };
  EXPECT_LT(off(with_prior), 0.5 * off(as_stated));
}

TEST(Use, HalvesAgreeWhereRobotAndCornersAreExact) {
  SceneSettings settings = protocol_settings(Setup::eye_to_hand);
  settings.corner_px = 0;
  const HandEyeScene scene = make_scene(settings, board_points(), 46);
  std::vector<Eigen::Isometry3d> poses;
  for (const Observation& o : scene.observations) poses.push_back(o.T_camera_target.front());
  const Bundle bundle = seeded_bundle(scene);
  RefineSettings refine_settings;
  refine_settings.noise = uniform_noise(bundle, 1, 1, 1, 1);
  const Halves halves =
      halves_apart(bundle, poses, Method::bundle, refine_settings, Eigen::Vector3d(0.6, 0.1, 0.3), 4);
  ASSERT_EQ(halves.apart.size(), 4U);
  EXPECT_LT(halves.rms(), 1e-4);  // Ceres stops where the cost no longer changes by 1e-10
  for (const std::vector<int>& first : halves.first) EXPECT_EQ(first.size(), scene.observations.size() / 2);
}

}  // namespace
}  // namespace flash::calib
