#include "calib/solve/errors_in_variables.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <random>

#include "calib/solve/lens_prior.h"
#include "tests/calib/hand_eye_scene.h"

namespace flash::calib {
namespace {

double rotation_error_deg(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  return rotation_angle(a.linear().transpose() * b.linear()) * 180 / M_PI;
}

class ErrorsInVariables : public testing::TestWithParam<Setup> {};
INSTANTIATE_TEST_SUITE_P(HandEye, ErrorsInVariables, testing::Values(Setup::eye_in_hand, Setup::eye_to_hand));

TEST_P(ErrorsInVariables, ExactRobotIsFoundToBeExact) {
  const HandEyeScene scene = protocol_scene(GetParam(), 0, 0, 4);
  Bundle plain = seeded_bundle(scene);
  solve_bundle(plain, uniform_noise(plain, 0.1, 1, 1, 1), {.unknowns = {.corrections = false}, .huber = 0});
  const Refinement refined = refine(seeded_bundle(scene));
  EXPECT_TRUE(refined.converged);
  EXPECT_NEAR(refined.noise.corner.front(), 0.1, 0.015);  // 160 residuals: 6 %
  const Vector6d sd = refined.covariance.diagonal().head<6>().cwiseSqrt();
  const Vector6d apart = motion_between(plain.cameras.front(), refined.bundle.cameras.front());
  EXPECT_TRUE((apart.cwiseAbs().array() < sd.array()).all()) << apart.transpose() << " / " << sd.transpose();
}

TEST_P(ErrorsInVariables, NoiseIsEstimatedAndTheStatedUncertaintyIsTrue) {
  constexpr int kTrials = 12;
  std::vector<double> closed, bundled, corrected;
  double nees = 0, corner = 0, rotation = 0, translation = 0;
  for (unsigned trial = 0; trial < kTrials; ++trial) {
    const HandEyeScene scene = protocol_scene(GetParam(), 0.1, 1, 100 + trial);
    closed.push_back(rotation_error_deg(park(loops_of(scene)).X, scene.truth.X));
    Bundle plain = seeded_bundle(scene);
    solve_bundle(plain, uniform_noise(plain, 1, 1, 1, 1), {.unknowns = {.corrections = false}, .huber = 0});
    bundled.push_back(rotation_error_deg(plain.cameras.front(), scene.truth.X));
    const Refinement refined = refine(seeded_bundle(scene));
    corrected.push_back(rotation_error_deg(refined.bundle.cameras.front(), scene.truth.X));
    const Vector6d error = motion_between(refined.bundle.cameras.front(), scene.truth.X);
    nees += error.dot(refined.covariance.topLeftCorner<6, 6>().ldlt().solve(error)) / kTrials;
    corner += refined.noise.corner.front() / kTrials;
    rotation += refined.noise.rotation.front() * 180 / M_PI / kTrials;
    translation += refined.noise.translation.front() * 1e3 / kTrials;
  }
  EXPECT_GT(nees, 3.4);  // chi-square with 72 degrees of freedom, 99.99 % band, over 12
  EXPECT_LT(nees, 9.6);
  EXPECT_NEAR(corner, 0.1, 0.01);
  EXPECT_NEAR(rotation, 0.1, 0.015);  // 12 x 45 residuals or more: 3 %; four times that
  EXPECT_NEAR(translation, 1, 0.15);
  const auto median = [](std::vector<double> v) {
    std::sort(v.begin(), v.end());
    return v[v.size() / 2];
  };
  EXPECT_LT(median(corrected), 0.7 * median(bundled));
  EXPECT_LT(median(corrected), 1.2 * median(closed));
}

// A heap of another past puts the unknowns at other addresses; what they are must not go with that.
TEST_P(ErrorsInVariables, SolutionDoesNotDependOnWhereTheUnknownsLieInMemory) {
  const HandEyeScene scene = protocol_scene(GetParam(), 0.05, 0.5, 7);
  Bundle bundle = seeded_bundle(scene);
  bundle.priors.warp_sd = {1e-3};
  bundle.priors.scale_sd = {3e-3};
  bundle.priors.lenses = {usual_lens_prior(scene.camera)};
  RefineSettings settings;
  settings.bundle.unknowns.scales = settings.bundle.unknowns.warps = true;
  settings.bundle.unknowns.intrinsics = kLensUnknowns;
  const Refinement once = refine(bundle, settings);
  std::mt19937 random(3);
  std::vector<std::vector<double>> kept;
  for (int run = 0; run < 5; ++run) {
    std::vector<std::vector<double>> freed;
    for (int i = 0; i < 2000; ++i) (random() % 2 ? kept : freed).emplace_back(1 + random() % 40);
    std::shuffle(freed.begin(), freed.end(), random);
    freed.clear();
    const Refinement again = refine(bundle, settings);
    EXPECT_EQ(again.bundle.cameras.front().matrix(), once.bundle.cameras.front().matrix());
    EXPECT_EQ(again.covariance, once.covariance);
    EXPECT_EQ(again.noise.rotation, once.noise.rotation);
  }
}

}  // namespace
}  // namespace flash::calib
