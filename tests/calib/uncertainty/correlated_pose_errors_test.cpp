#include "calib/uncertainty/correlated_pose_errors.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>

#include "calib/uncertainty/systematic_uncertainty.h"
#include "tests/calib/arm_scene.h"

namespace flash::calib {
namespace {

constexpr double kChiSquare95 = 12.592;  // 6 degrees of freedom

SceneSettings noisy() {
  SceneSettings settings = protocol_settings(Setup::eye_to_hand);
  settings.robot_deg = 0.05;
  settings.robot_mm = 0.3;
  return settings;
}

Refinement refined(const HandEyeScene& scene) {
  return refine(make_bundle(scene.settings.setup, scene.camera, scene.points, scene.observations,
                            shah(loops_of(scene))));
}

SystematicUncertainty uncertainty_of(const Refinement& solution) {
  return systematic_uncertainty(solution, {}, fit_pose_errors(solution, {}));
}

double squared_distance(const HandEyeScene& scene, const Refinement& solution,
                        const Eigen::MatrixXd& covariance) {
  const Vector6d error = motion_between(solution.bundle.cameras.front(), scene.truth.X);
  return error.dot(covariance.topLeftCorner<6, 6>().ldlt().solve(error));
}

constexpr double kOdds = 9;  // before any view is seen

TEST(CorrelatedPoseErrors, NoiseAloneRarelyShowsThem) {
  // Once in twenty; more than five of twenty happen in one of 3,000 such tests.
  int found = 0;
  double noise = 0, all = 0;
  for (unsigned seed = 31; seed <= 50; ++seed) {
    const Refinement solution = refined(make_scene(noisy(), tag_points(), seed));
    const SystematicUncertainty systematic = uncertainty_of(solution);
    found += systematic.arms.front().found;
    const double share = systematic.arms.front().share;
    EXPECT_LT(share / (1 - share), kOdds * 19);  // the views by themselves speak for them less than 19 to 1
    noise += solution.covariance.topLeftCorner<3, 3>().trace();
    all += systematic.covariance.topLeftCorner<3, 3>().trace();
  }
  EXPECT_LE(found, 5);
  EXPECT_GT(all, noise);
  EXPECT_LT(all, 16 * noise);  // up to four deviations: what hides in noise is as large as among arms in use
}

TEST(CorrelatedPoseErrors, OfAWrongKinematicModelAreFoundAndMostlyCovered) {
  // A field is a stand-in for joints that it knows nothing of, so three quarters of the arms are asked, not
  // 95 %. Of what noise alone states, zeros of 0.3 deg leave next to none.
  int found = 0, by_noise = 0, covered = 0;
  for (unsigned seed = 101; seed <= 120; ++seed) {
    const HandEyeScene scene = make_arm_scene(
        noisy(), {.zero_deg = 0.3, .length_mm = 0.5, .harmonic_deg = 0.1}, 0.6, tag_points(), seed);
    const Refinement solution = refined(scene);
    const SystematicUncertainty systematic = uncertainty_of(solution);
    found += systematic.arms.front().found;
    by_noise += squared_distance(scene, solution, solution.covariance) < kChiSquare95;
    covered += squared_distance(scene, solution, systematic.covariance) < kChiSquare95;
  }
  EXPECT_GE(found, 15);
  EXPECT_LE(by_noise, 5);
  EXPECT_GE(covered, 11);  // as a share of three quarters leaves in 98 of 100 sets of twenty
}

/// Errors of translation that agree over turns of joints [rad]: a Gaussian field drawn by the Cholesky factor
/// of exp(-d^2 / 2).
void add_field(HandEyeScene& scene, double size, double length, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  const auto count = static_cast<Eigen::Index>(scene.observations.size());
  const auto squared = [&](Eigen::Index i, Eigen::Index j) {
    const Eigen::Isometry3d &a = scene.observations[static_cast<std::size_t>(i)].T_base_gripper,
                            &b = scene.observations[static_cast<std::size_t>(j)].T_base_gripper;
    constexpr double kArm = 0.6;  // [m]
    return 0.5 * (a.linear() - b.linear()).squaredNorm() +
           (a.translation() - b.translation()).squaredNorm() / (kArm * kArm);
  };
  Eigen::MatrixXd K = 1e-9 * Eigen::MatrixXd::Identity(count, count);
  for (Eigen::Index i = 0; i < count; ++i)
    for (Eigen::Index j = 0; j < count; ++j) K(i, j) += std::exp(-0.5 * squared(i, j) / (length * length));
  const Eigen::MatrixXd white = Eigen::MatrixXd::NullaryExpr(count, 3, [&] { return normal(random); });
  const Eigen::MatrixXd field = size * Eigen::MatrixXd(K.llt().matrixL()) * white;
  for (Eigen::Index i = 0; i < count; ++i)
    scene.observations[static_cast<std::size_t>(i)].T_base_gripper.translation() += field.row(i).transpose();
}

TEST(CorrelatedPoseErrors, AFieldThatWasDrawnIsFoundAndCovered) {
  // 3 mm over 3 rad: those of arms reach over 2 to 8. 40 trials: 38 are inside where
  // sizes are known; they are estimated from a handful of modes that can be seen.
  int found = 0, by_noise = 0, covered = 0;
  for (unsigned seed = 201; seed <= 240; ++seed) {
    HandEyeScene scene = make_scene(noisy(), tag_points(), seed);
    add_field(scene, 3e-3, 3, seed);
    const Refinement solution = refined(scene);
    const SystematicUncertainty systematic = uncertainty_of(solution);
    found += systematic.arms.front().found;
    by_noise += squared_distance(scene, solution, solution.covariance) < kChiSquare95;
    covered += squared_distance(scene, solution, systematic.covariance) < kChiSquare95;
  }
  EXPECT_GE(found, 32);
  EXPECT_LT(by_noise, covered);
  EXPECT_GE(covered, 32);
}

TEST(CorrelatedPoseErrors, AreTheSameWhereverTheBaseStands) {
  HandEyeScene scene = make_arm_scene(noisy(), {.zero_deg = 1}, 0.6, tag_points(), 101);
  const SystematicUncertainty here = uncertainty_of(refined(scene));
  const Eigen::Isometry3d turn = make_pose({1.5, -2, 0.7}, {0.3, -1.1, 2.0});
  for (Observation& o : scene.observations) o.T_base_gripper = turn * o.T_base_gripper;
  const SystematicUncertainty there = uncertainty_of(refined(scene));
  ASSERT_TRUE(here.arms.front().found);
  // As far as both iterations converge.
  EXPECT_NEAR(here.arms.front().gain, there.arms.front().gain, 0.05);
  const Matrix6d a = here.covariance.topLeftCorner<6, 6>(), b = there.covariance.topLeftCorner<6, 6>();
  EXPECT_LT((a - b).norm(), 0.05 * a.norm());
}

TEST(CorrelatedPoseErrors, DoNotHangOnTheLastDigits) {
  // Two runs of a detector find corners that differ by rounding.
  for (const unsigned seed : {101U, 103U, 105U, 107U}) {
    HandEyeScene scene = make_arm_scene(noisy(), {.zero_deg = 1}, 0.6, tag_points(), seed);
    const Eigen::MatrixXd before = uncertainty_of(refined(scene)).covariance;
    std::mt19937 random(seed);
    std::normal_distribution<double> normal;
    for (Observation& o : scene.observations)
      o.pixels += 1e-10 * Eigen::Matrix2Xd::NullaryExpr(2, o.pixels.cols(), [&] { return normal(random); });
    const Eigen::MatrixXd after = uncertainty_of(refined(scene)).covariance;
    EXPECT_LT((after - before).norm(), 0.02 * before.norm()) << "seed " << seed;
  }
}

}  // namespace
}  // namespace flash::calib
