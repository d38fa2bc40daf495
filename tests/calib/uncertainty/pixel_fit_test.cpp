#include "calib/uncertainty/pixel_fit.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "tests/calib/hand_eye_scene.h"

namespace flash::calib {
namespace {

TEST(PixelFit, NoPlaceOfTheCameraOrTheTargetHasFewerPixels) {
  const HandEyeScene scene = protocol_scene(Setup::eye_in_hand, 0.05, 0.5, 31);
  const Refinement refined = refine(seeded_bundle(scene));
  const PixelFit fit = fit_pixels(refined, {}, fit_pose_errors(refined, {}));
  Bundle bundle = refined.bundle;
  const auto pixels = [&](const Eigen::Isometry3d& X, const Eigen::Isometry3d& Z) {
    bundle.cameras.front() = X;
    bundle.targets.front() = Z;
    return reprojection_rms(bundle, false);
  };
  const double least = pixels(fit.poses.X, fit.poses.Z);
  for (Eigen::Index axis = 0; axis < 6; ++axis)
    for (const double step : {-1e-4, 1e-4}) {
      const Vector6d xi = step * Vector6d::Unit(axis);
      EXPECT_GT(pixels(moved(fit.poses.X, xi), fit.poses.Z), least);
      EXPECT_GT(pixels(fit.poses.X, moved(fit.poses.Z, xi)), least);
    }
}

// The covariance against the scatter of sixty scenes whose noise is independent.
TEST(PixelFit, StatesItsScatter) {
  for (const calib::Setup setup : {calib::Setup::eye_in_hand, calib::Setup::eye_to_hand}) {
    constexpr int kTrials = 60;
    const PoseErrorModel independent{.arms = {{}}, .poses = {{}}, .covariance = {{}}};
    double nees = 0;
    for (unsigned trial = 0; trial < kTrials; ++trial) {
      const HandEyeScene scene = protocol_scene(setup, 0.05, 0.5, 700 + trial);
      const Refinement refined = refine(seeded_bundle(scene));
      const PixelFit fit = fit_pixels(refined, {}, independent);
      const Vector6d error = motion_between(fit.poses.X, scene.truth.X);
      nees += error.dot(fit.repeatable.ldlt().solve(error)) / kTrials;
    }
    // 6 for a true covariance, to 3 sqrt(12 / 60) by chance; noise levels from 15 to 20 views cost another 2.
    EXPECT_GT(nees, 6 - 1.4);
    EXPECT_LT(nees, 6 + 3.4);
  }
}

}  // namespace
}  // namespace flash::calib
