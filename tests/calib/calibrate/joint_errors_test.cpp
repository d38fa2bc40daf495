#include "calib/uncertainty/joint_errors.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "calib/calibrate/calibrate.h"
#include "calib/calibrate/cell.h"
#include "tests/calib/cell_member.h"
#include "tests/calib/joint_scene.h"

namespace flash::calib {
namespace {

Calibration calibrated(const HandEyeScene& scene) {
  CalibrateSettings settings;
  settings.folds = 2;
  return calibrate(scene.settings.setup, scene.camera, scene.points, grid_symmetries(scene.points),
                   scene.observations, settings);
}

std::optional<JointErrors> errors_of(const Calibration& result) {
  return joint_errors(result.refined.bundle, result.unknowns, result.shared_covariance);
}

Eigen::VectorXd all_errors(const WrongArm& wrong) {
  Eigen::VectorXd errors(wrong.zeros.size() + wrong.lengths.size());
  errors << wrong.zeros, wrong.lengths;
  return errors;
}

/// Only the zeros are wrong.
WrongArm turned(const Eigen::VectorXd& zeros) { return {zeros, {}}; }

TEST(JointErrors, ChainsOfJointsAreTheArmInClosedForm) {
  Eigen::Matrix<double, 6, 1> q;
  q << 0.3, -1.6, 1.5, -1.4, -1.57, 0.2;
  EXPECT_TRUE(gripper_pose(chain_of(nominal_arm()), q).isApprox(nominal_arm().pose(q), 1e-12));
}

TEST(JointErrors, ZerosAreFoundAndTakeTheirErrorOutOfTheAnswer) {
  constexpr unsigned kTrials = 10, kCompared = 3;
  constexpr double kChiSquare95 = 12.592;
  double with_joints = 0, without = 0, squared = 0;
  int inside = 0;
  for (unsigned trial = 0; trial < kTrials; ++trial) {
    std::mt19937 random(900 + trial);
    std::normal_distribution<double> normal(0, kUsualJointZero);
    Eigen::VectorXd zeros(6);
    for (double& zero : zeros) zero = normal(random);
    for (const bool known : {false, true}) {
      if (!known && trial >= kCompared) continue;
      const HandEyeScene scene = recorded(turned(zeros), known ? Known::joints : Known::poses, 900 + trial);
      const Calibration result = calibrated(scene);
      const Vector6d error = motion_between(result.poses.X, scene.truth.X);
      if (trial < kCompared) (known ? with_joints : without) += error.head<3>().squaredNorm();
      const std::optional<JointErrors> found = errors_of(result);
      ASSERT_EQ(found.has_value(), known);
      if (!known) continue;
      inside += error.dot(result.covariance.ldlt().solve(error)) < kChiSquare95;
      squared += ((found->estimate - zeros).array() / found->sd.array()).square().mean() / kTrials;
      // The joints between the first and the last turn camera and target against each other.
      EXPECT_FALSE(found->told(0));
      for (Eigen::Index i = 1; i < 5; ++i) EXPECT_TRUE(found->told(i)) << i;
    }
  }
  EXPECT_LT(with_joints, without);
  EXPECT_GE(inside, 8);     // of ten at 95 %: fewer once in eighty
  EXPECT_GT(squared, 0.4);  // 60 squares of unit mean, six of a trial correlated: 0.26 a standard deviation
  EXPECT_LT(squared, 1.8);
}

// One zero by twenty of its deviations: it is found to what the others are, and they are not bent by it.
TEST(JointErrors, AZeroThatIsGrosslyOffIsFoundAndNamed) {
  for (const double off : {1.0, 2.0, -4.0}) {
    WrongArm wrong = turned(Eigen::VectorXd::Zero(6));
    wrong.zeros[3] = off * M_PI / 180;
    const HandEyeScene scene = recorded(wrong, Known::joints, 950);
    const Calibration result = calibrated(scene);
    const JointErrors found = *errors_of(result);
    EXPECT_NEAR(found.estimate[3], wrong.zeros[3], 4 * found.sd[3]) << off;
    EXPECT_LT(found.sd[3], 0.02 * M_PI / 180) << off;
    for (const Eigen::Index other : {1, 2, 4})
      EXPECT_NEAR(found.estimate[other], 0, 4 * found.sd[other]) << off;
    const Vector6d error = motion_between(result.poses.X, scene.truth.X);
    EXPECT_LT(error.dot(result.covariance.ldlt().solve(error)), 22.458) << off;  // of 99.9 %
    const std::vector<std::string> sentences = joints_far_off(found, described_arm({}, 0));
    ASSERT_EQ(sentences.size(), 1u) << off;
    EXPECT_NE(sentences.front().find("were to be expected"), std::string::npos) << sentences.front();
  }
}

// Zeros and lengths drawn from what is known of them: intervals of 95 % hold, those of lengths that are told
// too, and the camera is nearer to where it is than with the lengths as described.
TEST(JointErrors, LengthsAreFoundBesideZeros) {
  constexpr unsigned kTrials = 8, kCompared = 5;
  constexpr double kChiSquare95 = 12.592, kLengthSd = 0.5e-3;
  double with_lengths = 0, without = 0;
  int camera_inside = 0, inside = 0, all = 0, told_inside = 0, told = 0;
  for (unsigned trial = 0; trial < kTrials; ++trial) {
    const WrongArm wrong = draw_wrong_arm(1200 + trial, kLengthSd);
    const Eigen::VectorXd truth = all_errors(wrong);
    for (const Known known : {Known::joints, Known::joints_and_lengths}) {
      if (known == Known::joints && trial >= kCompared) continue;
      const HandEyeScene scene = recorded(wrong, known, 1200 + trial, Setup::eye_in_hand, kLengthSd);
      const Calibration result = calibrated(scene);
      const Vector6d error = motion_between(result.poses.X, scene.truth.X);
      if (trial < kCompared)
        (known == Known::joints ? without : with_lengths) += error.head<3>().squaredNorm();
      if (known == Known::joints) continue;
      camera_inside += error.dot(result.covariance.ldlt().solve(error)) < kChiSquare95;
      const JointErrors found = errors_of(result).value();
      ASSERT_EQ(found.estimate.size(), truth.size());
      for (Eigen::Index i = 0; i < truth.size(); ++i) {
        const Eigen::Vector2d interval = found.interval(i);
        const bool holds = interval[0] < truth[i] && truth[i] < interval[1];
        inside += holds;
        ++all;
        if (i < 6 || !found.told(i)) continue;
        told_inside += holds;
        ++told;
      }
      // What camera and target take up: the first joint's place, and the tool behind the last.
      for (const Eigen::Index i : {0, 6, 7, 18, 19, 20}) EXPECT_FALSE(found.told(i)) << i;
    }
  }
  EXPECT_LT(with_lengths, without);
  EXPECT_GE(camera_inside, 6);  // of eight at 95 %: fewer once in 170
  EXPECT_GE(inside, 0.9 * all);
  EXPECT_GE(told, 4 * static_cast<int>(kTrials));
  EXPECT_GE(told_inside, 0.9 * told);
}

/// Another recording in the same poses, with noise of its own.
HandEyeScene recorded_again(HandEyeScene scene, const WrongArm& wrong, unsigned seed) {
  const SerialChain described = described_arm(wrong.lengths, kUsualLinkLength).chain;
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  for (std::size_t i = 0; i < scene.observations.size(); ++i) {
    Observation& view = scene.observations[i];
    const Eigen::Isometry3d T = scene.truth.X.inverse() * scene.true_poses[i].inverse() * scene.truth.Z;
    for (Eigen::Index k = 0; k < scene.points.cols(); ++k)
      view.pixels.col(k) = project(to_vector(scene.camera), T * scene.points.col(k)) +
                           scene.settings.corner_px * Eigen::Vector2d(normal(random), normal(random));
    view.T_camera_target = {fitted_pose(scene.camera, scene.points, view.pixels, T)};
    view.T_base_gripper = moved(gripper_pose(described, scene.joints[i] - wrong.zeros), robot_noise(random));
  }
  return scene;
}

// What is not told of an arm is the same in another recording of it.
TEST(JointErrors, AnotherRecordingOfTheArmDiffersByWhatIsRepeatable) {
  constexpr unsigned kPairs = 6;
  constexpr double kLengthSd = 0.5e-3;
  double squares = 0, stated = 0;
  for (unsigned pair = 0; pair < kPairs; ++pair) {
    const WrongArm wrong = draw_wrong_arm(1400 + pair, kLengthSd);
    const HandEyeScene scene =
        recorded(wrong, Known::joints_and_lengths, 1400 + pair, Setup::eye_in_hand, kLengthSd);
    const Calibration one = calibrated(scene), other = calibrated(recorded_again(scene, wrong, 1500 + pair));
    const Vector6d apart = motion_between(one.poses.X, other.poses.X);
    squares += apart.dot((one.repeatable + other.repeatable).ldlt().solve(apart));
    stated += apart.dot((one.covariance + other.covariance).ldlt().solve(apart));
  }
  EXPECT_GT(squares, 15.3);  // 36 degrees of freedom, 99.9 % band
  EXPECT_LT(squares, 68);
  EXPECT_LT(stated, 0.5 * squares);
}

TEST(JointErrors, LengthsThatAreRightStayZero) {
  constexpr unsigned kTrials = 8;
  int claimed = 0, told = 0;
  for (unsigned trial = 0; trial < kTrials; ++trial) {
    const WrongArm wrong = draw_wrong_arm(1300 + trial, 0);
    const Calibration result =
        calibrated(recorded(wrong, Known::joints_and_lengths, 1300 + trial, Setup::eye_in_hand, 0.5e-3));
    const JointErrors found = errors_of(result).value();
    for (Eigen::Index i = 6; i < found.estimate.size(); ++i) {
      const Eigen::Vector2d interval = found.interval(i);
      const bool differs = interval[0] > 0 || interval[1] < 0;
      EXPECT_FALSE(differs && !found.told(i)) << i;
      told += found.told(i);
      claimed += differs;
    }
  }
  EXPECT_LE(claimed, 0.1 * told);  // 5 % of chance and as much again: lengths of one arm err together
}

TEST(JointErrors, ZerosOfTwoArmsOnOneCameraAreSolvedForTogether) {
  constexpr double kChiSquare999 = 22.458;  // 6 degrees of freedom
  std::mt19937 random(950);
  std::normal_distribution<double> normal(0, kUsualJointZero);
  std::array<Eigen::VectorXd, 2> zeros = {Eigen::VectorXd(6), Eigen::VectorXd(6)};
  for (Eigen::VectorXd& of_arm : zeros)
    for (double& zero : of_arm) zero = normal(random);
  std::array<double, 2> off{};
  for (const bool known : {false, true}) {
    const Known what = known ? Known::joints : Known::poses;
    const HandEyeScene left = recorded(turned(zeros[0]), what, 950, Setup::eye_to_hand),
                       right = recorded(turned(zeros[1]), what, 951, Setup::eye_to_hand);
    const Cell cell = solve_cell({member_of(left, "left"), member_of(right, "right")});
    const Vector6d error = motion_between(cell.bases[0].transform.T, left.truth.X * right.truth.X.inverse());
    off[known ? 1 : 0] = error.head<3>().norm();
    if (!known) continue;
    EXPECT_LT(error.dot(cell.bases[0].covariance.ldlt().solve(error)), kChiSquare999);
  }
  EXPECT_LT(off[1], off[0]);
}

// One arm's links are unknowns, the other's are not.
TEST(JointErrors, EachArmOfACellHasItsOwn) {
  const WrongArm right_arm = turned(Eigen::VectorXd::Zero(6));
  const Bundle bundle =
      cell_bundle({member_of(recorded(right_arm, Known::joints_and_lengths, 970, Setup::eye_to_hand), "left"),
                   member_of(recorded(right_arm, Known::joints, 971, Setup::eye_to_hand), "right")});
  ASSERT_EQ(bundle.joint_errors.size(), 2U);
  EXPECT_EQ(bundle.joint_errors[0].size(), 21);
  EXPECT_EQ(bundle.joint_errors[1].size(), 6);
  EXPECT_EQ(bundle.joint_error_sd[0][20], kUsualLinkLength);
}

TEST(JointErrors, OfOneArmOfTwoAreNotSolvedFor) {
  const WrongArm right_arm = turned(Eigen::VectorXd::Zero(6));
  std::vector<std::string> notices;
  const Bundle bundle =
      cell_bundle({member_of(recorded(right_arm, Known::joints, 960, Setup::eye_to_hand), "left"),
                   member_of(recorded(right_arm, Known::poses, 961, Setup::eye_to_hand), "right")},
                  &notices);
  EXPECT_TRUE(bundle.joint_errors.empty());
  for (const RobotPose& pose : bundle.poses) EXPECT_EQ(pose.joint_motions.cols(), 0);
  ASSERT_EQ(notices.size(), 1U);
}

}  // namespace
}  // namespace flash::calib
