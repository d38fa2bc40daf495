#include "calib/uncertainty/target_size.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <limits>

#include "calib/calibrate/calibrate.h"
#include "calib/calibrate/extrinsics.h"
#include "calib/check/projection_check.h"
#include "calib/solve/linearization.h"
#include "data/files/error.h"
#include "tests/calib/hand_eye_scene.h"

namespace flash::calib {
namespace {

/// A scene whose printed target is `scale` times as large as the points that are handed over.
HandEyeScene scene_of(Setup setup, double scale, unsigned seed) {
  SceneSettings settings = protocol_settings(setup);
  settings.views = 20;
  settings.robot_deg = 0.05;
  settings.robot_mm = 0.5;
  HandEyeScene scene = make_scene(settings, scale * board_points(), seed);
  scene.points /= scale;
  for (Observation& o : scene.observations)
    o.T_camera_target = {
        fitted_pose(scene.camera, scene.points(Eigen::all, o.points), o.pixels, o.T_camera_target.front())};
  return scene;
}

Calibration calibrated(const HandEyeScene& scene, double size_sd = kPrintSd) {
  CalibrateSettings settings;
  settings.target_size_sd = size_sd;
  return calibrate(scene.settings.setup, scene.camera, scene.points, grid_symmetries(scene.points),
                   scene.observations, settings);
}

double millimetres_off(const Calibration& result, const HandEyeScene& scene) {
  return 1e3 * (result.poses.X.translation() - scene.truth.X.translation()).norm();
}

class TargetSizes : public testing::TestWithParam<Setup> {};
INSTANTIATE_TEST_SUITE_P(HandEye, TargetSizes, testing::Values(Setup::eye_in_hand, Setup::eye_to_hand));

constexpr double kStated = 0, kUnknown = std::numeric_limits<double>::infinity();

TEST_P(TargetSizes, SizeThatIsNotKnownIsMeasuredAndNoLongerMovesTheCamera) {
  const HandEyeScene scene = scene_of(GetParam(), 1.015, 21);
  const Calibration result = calibrated(scene, kUnknown);
  ASSERT_TRUE(result.size);
  EXPECT_NEAR(result.size->estimate, 1.015, 4 * result.size->sd);
  const Vector6d error = motion_between(result.poses.X, scene.truth.X);
  const Vector6d sd = result.covariance.diagonal().cwiseSqrt();
  EXPECT_TRUE((error.cwiseAbs().array() < 4 * sd.array()).all())
      << error.transpose() << " / " << sd.transpose();
  // As stated, every distance from the camera is short by 1.5 %.
  const double distance = scene.settings.distance * 1e3;
  EXPECT_GT(millimetres_off(calibrated(scene, kStated), scene), 0.2 * 0.015 * distance);
  EXPECT_LT(millimetres_off(result, scene), 0.2 * 0.015 * distance);
}

// One that is far from what is stated is where the solution begins: nothing stated excludes it.
TEST_P(TargetSizes, SizeThatIsNotKnownMayBeAny) {
  for (const double size : {0.3, 4.0}) {
    // The same pictures of a target that is stated so many times too small, and so as near.
    HandEyeScene scene = scene_of(GetParam(), 1, 5);
    scene.points /= size;
    for (Observation& o : scene.observations) o.T_camera_target.front().translation() /= size;
    EXPECT_THROW(calibrated(scene), data::InputError) << size;
    const Calibration result = calibrated(scene, std::numeric_limits<double>::infinity());
    EXPECT_TRUE(result.usable) << size << ' ' << result.warnings.front();
    EXPECT_EQ(result.used.size(), scene.observations.size()) << size;
    EXPECT_LT(std::abs(result.size->estimate - size), 4 * result.size->sd) << size;
    const Vector6d error = motion_between(result.poses.X, scene.truth.X);
    EXPECT_LT(error.dot(result.covariance.ldlt().solve(error)), 22.5) << size;  // 99.9 % of chi-square, 6
    EXPECT_LT(result.centre_rms, 2 * result.chain_rms) << size;
  }
}

TEST_P(TargetSizes, ValidationIsForSizeWarpAndLensThatWereSolvedFor) {
  const HandEyeScene scene = scene_of(GetParam(), 1.015, 21);
  const Calibration result = calibrated(scene, kUnknown);
  const Target target = parse_target("chessboard:9x6:0.025");
  const Extrinsics extrinsics = extrinsics_of(result, {});
  const ProjectionCheck check = check_projection(
      scene.settings.setup, result.poses, *extrinsics.lens, target,
      with_poses_for(*extrinsics.lens, target, extrinsics.target, scene.observations, extrinsics.edge_offset),
      extrinsics.target, extrinsics.edge_offset);
  EXPECT_NEAR(check.corner_rms, result.chain_rms, 1e-9);  // the same sum, the other way round
}

TEST_P(TargetSizes, PriorAndPicturesCountByTheirVariances) {
  const HandEyeScene scene = scene_of(GetParam(), 1.004, 22);
  const TargetSize size = *calibrated(scene).size;
  ASSERT_TRUE(size.wanted);
  const double by_prior = std::pow(size.prior_sd, -2), by_pictures = std::pow(size.wanted->sd, -2);
  const double expected = (by_prior + by_pictures * size.wanted->estimate) / (by_prior + by_pictures);
  // The problem is linear to second order in the size's 0.4 %, and noise is estimated with each size anew.
  EXPECT_NEAR(size.estimate, expected, 0.1 * std::abs(size.wanted->estimate - 1));
  EXPECT_NEAR(size.sd, 1 / std::sqrt(by_prior + by_pictures), 0.1 * size.sd);
}

TEST_P(TargetSizes, AnswerGoesFromStatedToUnknownWithoutAJump) {
  const HandEyeScene scene = scene_of(GetParam(), 1.01, 24);
  double last = 1;
  for (const double sd : {1e-4, 3e-4, 1e-3, 3e-3, 1e-2, 3e-2, 0.1}) {
    const double estimate = calibrated(scene, sd).size->estimate;
    EXPECT_GE(estimate, last - 1e-6) << sd;
    last = estimate;
  }
  const TargetSize free = *calibrated(scene, kUnknown).size;
  EXPECT_NEAR(last, free.estimate, 0.1 * free.sd);
  EXPECT_NEAR(calibrated(scene, 1e-4).size->estimate, 1, 1e-4);
}

TEST_P(TargetSizes, SizeFarOffIsNamedAndRefused) {
  const HandEyeScene scene = scene_of(GetParam(), 1.08, 23);
  const Calibration result = calibrated(scene);
  ASSERT_TRUE(result.size && result.size->far_off());
  EXPECT_FALSE(result.usable);
  EXPECT_TRUE(result.warnings.front().starts_with("the estimated size of the target is 1.0"))
      << result.warnings.front();
  EXPECT_TRUE(result.warnings.front().ends_with("the answer cannot be used")) << result.warnings.front();
  // To the last digit: nothing of it is in the deviations.
  const Calibration stated = calibrated(scene, kStated);
  EXPECT_FALSE(stated.usable);
  EXPECT_EQ(stated.refined.bundle.scales.front(), 1);
  EXPECT_TRUE(stated.warnings.front().starts_with("the estimated size of the target is 1.0"))
      << stated.warnings.front();
}

/// As `--target-size stated` does.
Calibration kept(const HandEyeScene& scene) {
  CalibrateSettings settings;
  settings.size_as_stated = true;
  settings.folds = 2;
  return calibrate(scene.settings.setup, scene.camera, scene.points, grid_symmetries(scene.points),
                   scene.observations, settings);
}

// Sizes as prints have them, on seeds that nothing was chosen on: X follows its size, and its deviations say
// so.
TEST_P(TargetSizes, SizeThatIsKeptAlwaysGivesAnAnswerThatHoldsWhatItMayBeOff) {
  constexpr double kChiSquare999 = 22.458;  // six degrees of freedom
  const double sd = usual_size_sd(board_points());
  for (unsigned seed = 7101; seed < 7113; ++seed) {
    std::mt19937 random(seed);
    const double size = 1 + sd * std::normal_distribution<double>()(random);
    const HandEyeScene scene = scene_of(GetParam(), size, seed);
    const Calibration result = kept(scene);
    EXPECT_TRUE(result.usable) << seed;
    EXPECT_EQ(result.refined.bundle.scales.front(), 1);
    const Vector6d error = motion_between(result.poses.X, scene.truth.X);
    EXPECT_LT(error.dot(result.covariance.ldlt().solve(error)), kChiSquare999) << seed;
  }
  // What pictures want far beyond the prior counts as well.
  for (const double size : {0.8, 0.97, 1.03, 1.08, 1.2}) {
    const HandEyeScene scene = scene_of(GetParam(), size, 7113);
    const Calibration result = kept(scene);
    EXPECT_TRUE(result.usable) << size << ": " << result.warnings.front();
    EXPECT_FALSE(result.other_part || result.drift) << size;  // its errors are no motion
    const Vector6d error = motion_between(result.poses.X, scene.truth.X);
    EXPECT_LT(error.dot(result.covariance.ldlt().solve(error)), kChiSquare999) << size;
  }
}

// The derivative by the size against a difference: of two solutions at the same noise.
TEST_P(TargetSizes, WhatASizeMayBeOffMovesTheAnswerAlongItsOwnDeviation) {
  constexpr double kStep = 1e-3, kSd = 0.004;
  const Calibration result = kept(scene_of(GetParam(), 1, 7121));
  RefineSettings settings;
  settings.bundle.unknowns = result.unknowns;
  settings.estimate_noise = settings.estimate_pivots = false;
  settings.noise = result.refined.noise;
  const auto camera = [&](double size) {
    Bundle bundle = result.refined.bundle;
    bundle.scales = {size};
    return refine(std::move(bundle), settings).bundle.cameras.front();
  };
  const Vector6d shift = kSd / (2 * kStep) * motion_between(camera(1 - kStep), camera(1 + kStep));
  TargetSize size = *result.size;
  size.wanted.reset();
  const Matrix6d more =
      covariance_of_kept_sizes(result.refined, settings.bundle, {size}, {kSd}).topLeftCorner<6, 6>();
  // Robust weights follow the size as well.
  EXPECT_LT((more - shift * shift.transpose()).norm(), 0.1 * more.norm());
}

// The linearised prior against differences of its residual, (s - 1) / sd.
TEST(SizePrior, StandsInTheLinearModelAsItsResidualDoes) {
  Bundle bundle = seeded_bundle(scene_of(Setup::eye_in_hand, 1, 25));
  bundle.priors.scale_sd = {0.004};
  bundle.priors.caution = {2.0};
  bundle.scales = {1.01};
  BundleSettings settings;
  settings.unknowns.scales = true;
  const LinearModel model = linearize(bundle, uniform_noise(bundle, 0.1, 1e-3, 1e-3, 1e-3), settings);
  const int column = shared_columns(bundle, settings.unknowns).scales.front();
  const auto squared = [](double s) { return std::pow((s - 1) / 0.002, 2); };
  constexpr double kStep = 1e-4;
  const double gradient = (squared(1.01 + kStep) - squared(1.01 - kStep)) / (2 * kStep);
  EXPECT_NEAR(2 * model.prior(column, model.shared), gradient, 1e-6 * gradient);
  EXPECT_NEAR(model.prior(column, column), std::pow(0.002, -2), 1e-6 * std::pow(0.002, -2));
  EXPECT_NEAR(model.prior(model.shared, model.shared), squared(1.01), 1e-9);
}

}  // namespace
}  // namespace flash::calib
