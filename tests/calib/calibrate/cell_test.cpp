#include "calib/calibrate/cell.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "data/files/error.h"
#include "tests/calib/cell_member.h"

namespace flash::calib {
namespace {

HandEyeScene arm_scene(unsigned seed) {
  SceneSettings settings = protocol_settings(Setup::eye_to_hand);
  settings.robot_deg = 0.05;
  settings.robot_mm = 0.5;
  return make_scene(settings, board_points(), seed);
}

/// Squared distance of the truth from what is stated of the second arm.
double squared_distance(const HandEyeScene& left, const HandEyeScene& right) {
  const Cell cell = solve_cell({member_of(left, "left", "camera"), member_of(right, "right", "camera")});
  EXPECT_EQ(cell.bases.size(), 1U);
  if (cell.bases.empty()) return 0;
  const Eigen::Isometry3d truth = left.truth.X * right.truth.X.inverse();
  const Vector6d error = motion_between(cell.bases[0].transform.T, truth);
  EXPECT_LT(error.head<3>().norm(), 5e-3);
  return error.dot(cell.bases[0].covariance.ldlt().solve(error));
}

TEST(Register, TwoArmsOnOneCameraAreWhereTheyAre) {
  constexpr int kTrials = 8;
  double chi_square = 0;
  for (unsigned trial = 0; trial < kTrials; ++trial) {
    const HandEyeScene left = arm_scene(20 + 2 * trial), right = arm_scene(21 + 2 * trial);
    chi_square += squared_distance(left, right);
  }
  // 48 degrees of freedom, 99.9 % band; these arms have noise alone, which nearly no arm has: stated up to
  // twice.
  EXPECT_GT(chi_square, 22.0 / 4);
  EXPECT_LT(chi_square, 84);
}

TEST(Register, TwoArmsThatAreTakenForOneAreRefused) {
  const HandEyeScene left = arm_scene(50), right = arm_scene(51);
  const Cell cell = solve_cell({member_of(left, "arm"), member_of(right, "arm")});
  EXPECT_FALSE(cell.usable);
  EXPECT_FALSE(cell.refusals.empty());
  const Cell told_apart = solve_cell({member_of(left, "left"), member_of(right, "right")});
  EXPECT_TRUE(told_apart.usable);
  EXPECT_TRUE(told_apart.refusals.empty());
}

TEST(Register, ACameraElsewhereThanOneRecordingSaysIsToldOfThat) {
  // The second recording by itself has the camera 20 mm away, to a tenth of a millimetre.
  const HandEyeScene scene = arm_scene(52);
  CellMember one = member_of(scene, "arm", "one"), two = member_of(scene, "arm", "two");
  two.poses.X = moved(two.poses.X, (Vector6d() << 0.02, 0, 0, 0, 0, 0).finished());
  two.covariance = 1e-8 * Matrix6d::Identity();
  const Cell cell = solve_cell({one, two});
  ASSERT_EQ(cell.refusals.size(), 1U);
  EXPECT_NE(cell.refusals.front().find("two of arm is"), std::string::npos) << cell.refusals.front();
}

TEST(Register, RecordingsThatCountTheirPicturesByThemselvesShareNoPoses) {
  // One camera, two recordings of one arm at other poses under the same numbers.
  HandEyeScene first = arm_scene(53), second = arm_scene(54);
  const Eigen::Isometry3d X = first.truth.X, Z = first.truth.Z;
  std::mt19937 random(6);
  std::normal_distribution<double> normal;
  for (std::size_t i = 0; i < second.observations.size(); ++i) {
    // The arm brings the target to where the second scene has it, in the first scene's camera.
    Observation& o = second.observations[i];
    const Eigen::Isometry3d T = o.T_camera_target.front();
    Vector6d noise;
    for (Eigen::Index k = 0; k < 6; ++k) noise[k] = (k < 3 ? 5e-4 : 0.05 * M_PI / 180) * normal(random);
    o.T_base_gripper = moved(X * T * Z.inverse(), noise);
    for (Eigen::Index k = 0; k < second.points.cols(); ++k)
      o.pixels.col(k) = project(to_vector(second.camera), T * second.points.col(k)) +
                        0.1 * Eigen::Vector2d(normal(random), normal(random));
  }
  const std::vector<CellMember> members = {member_of(first, "arm"), member_of(second, "arm")};
  const Bundle bundle = cell_bundle(members);
  EXPECT_EQ(bundle.poses.size(), first.observations.size() + second.observations.size());
  const Cell cell = solve_cell(members);
  const Vector6d error = motion_between(cell.cameras.front().transform.T, X);
  EXPECT_LT(error.dot(cell.cameras.front().covariance.ldlt().solve(error)), 22.5);  // 99.9 % of chi-square, 6
}

TEST(Register, WhatMayHaveMovedWhileEitherWasRecordedIsStated) {
  CellMember left = member_of(arm_scene(40), "left"), right = member_of(arm_scene(41), "right");
  const Cell still = solve_cell({left, right});
  std::mt19937 random(40);
  std::normal_distribution<double> normal(0, 1e-3);
  for (CellMember* member : {&left, &right}) {
    Vector6d shift;
    for (double& value : shift) value = normal(random);
    member->motion_covariance = shift * shift.transpose();
  }
  const Cell moved = solve_cell({left, right});
  EXPECT_TRUE(
      (moved.cameras[0].covariance - still.cameras[0].covariance).isApprox(left.motion_covariance, 1e-9));
  // As two transforms that are composed, where nothing else is uncertain.
  Extrinsics a, b;
  a.setup = b.setup = Setup::eye_to_hand;
  a.transform.T = left.poses.X;
  b.transform.T = right.poses.X;
  a.covariance = left.motion_covariance;
  b.covariance = right.motion_covariance;
  const Matrix6d composed = compose_cell({"left", "right"}, {a, b}).bases[0].covariance;
  EXPECT_TRUE((moved.bases[0].covariance - still.bases[0].covariance).isApprox(composed, 1e-9));
}

TEST(Register, ComposedCovarianceIsThatOfTheProduct) {
  Extrinsics a, b;
  a.setup = b.setup = Setup::eye_to_hand;
  a.transform = {"base", "camera", make_pose({1, 0.2, 0.3}, {0.4, 0.5, -0.6})};
  b.transform = {"base", "camera", make_pose({-0.5, 0.7, 0.4}, {1.4, -0.5, 0.6})};
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  Matrix6d La, Lb;
  for (Matrix6d* L : {&La, &Lb})
    for (int i = 0; i < 36; ++i) (*L)(i / 6, i % 6) = 1e-3 * normal(random);
  a.covariance = La * La.transpose();
  b.covariance = Lb * Lb.transpose();
  const Cell cell = compose_cell({"a", "b"}, {a, b});
  Matrix6d sampled = Matrix6d::Zero();
  constexpr int kSamples = 20000;
  for (int i = 0; i < kSamples; ++i) {
    Vector6d xa, xb;
    for (int k = 0; k < 6; ++k) {
      xa[k] = normal(random);
      xb[k] = normal(random);
    }
    const Vector6d xi = motion_between(
        cell.bases[0].transform.T, moved(a.transform.T, La * xa) * moved(b.transform.T, Lb * xb).inverse());
    sampled += xi * xi.transpose() / kSamples;
  }
  // Sampling error of a variance: sqrt(2 / 20,000) = 1 %; five times that.
  EXPECT_LT((cell.bases[0].covariance - sampled).norm(), 0.05 * sampled.norm());
  a.setup = Setup::eye_in_hand;
  EXPECT_THROW(compose_cell({"a", "b"}, {b, a}), data::InputError);
}

TEST(Register, CamerasThatNumberTheBoardFromItsOtherEndAreAligned) {
  // The same robot poses seen by two cameras: the second scene's camera is moved, its corners made anew.
  const HandEyeScene first = arm_scene(5);
  HandEyeScene second = first;
  second.truth.X = first.truth.X * make_pose({0.25, 0.05, 0.02}, {0.05, -0.25, 0.3});
  const std::vector<Symmetry> symmetries = grid_symmetries(first.points);
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  for (std::size_t i = 0; i < second.observations.size(); ++i) {
    Observation& o = second.observations[i];
    const Eigen::Isometry3d T = second.truth.X.inverse() * first.true_poses[i] * first.truth.Z;
    for (Eigen::Index k = 0; k < first.points.cols(); ++k) {
      const auto seen = static_cast<std::size_t>(k);
      o.points[seen] = symmetries[1].permutation[seen];
      o.pixels.col(k) = project(to_vector(first.camera), T * first.points.col(k)) +
                        0.1 * Eigen::Vector2d(normal(random), normal(random));
    }
    o.T_camera_target = {T * symmetries[1].turn.inverse()};
  }
  const Cell cell = solve_cell({member_of(first, "arm", "one"), member_of(second, "arm", "two")});
  ASSERT_EQ(cell.cameras.size(), 2U);
  EXPECT_EQ(cell.notices.size(), 1U);
  EXPECT_NEAR(cell.corner_rms, std::sqrt(2.0) * 0.1, 0.02);
  for (const auto& [frame, truth] :
       {std::pair{cell.cameras[0], first.truth.X}, {cell.cameras[1], second.truth.X}}) {
    const Vector6d error = motion_between(frame.transform.T, truth);
    EXPECT_LT(error.dot(frame.covariance.ldlt().solve(error)), 22.5);  // 99.9 % of chi-square, 6
  }
  // Between the cameras the robot's noise cancels: far better than either alone.
  const Vector6d apart = motion_between(cell.cameras[0].transform.T.inverse() * cell.cameras[1].transform.T,
                                        first.truth.X.inverse() * second.truth.X);
  EXPECT_LT(apart.head<3>().norm(), 1e-3);
}

TEST(Register, SizeOfATargetIsNotSolvedForWhereArmsOnlyTurn) {
  // All about one point: camera and target twice as far from it look the same.
  HandEyeScene scene = arm_scene(7);
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  for (std::size_t i = 0; i < scene.observations.size(); ++i) {
    Observation& o = scene.observations[i];
    o.T_base_gripper.translation() = scene.true_poses.front().translation();
    const Eigen::Isometry3d T = scene.truth.X.inverse() * o.T_base_gripper * scene.truth.Z;
    for (Eigen::Index k = 0; k < scene.points.cols(); ++k)
      o.pixels.col(k) = project(to_vector(scene.camera), T * scene.points.col(k)) +
                        0.1 * Eigen::Vector2d(normal(random), normal(random));
    o.T_camera_target = {T};
  }
  CellMember member = member_of(scene, "arm", "camera");
  member.poses = scene.truth;
  const Cell cell = solve_cell({member});
  ASSERT_EQ(cell.sizes.size(), 1U);
  EXPECT_FALSE(cell.sizes.front().wanted);
  const double known = usual_size_sd(scene.points);
  EXPECT_NEAR(cell.sizes.front().sd, known, 0.02 * known);  // nothing but the prior tells it
  try {
    CellSettings settings;
    settings.target_size_sd = std::numeric_limits<double>::infinity();
    solve_cell({member}, settings);
    FAIL() << "accepted";
  } catch (const data::InputError& error) {
    EXPECT_NE(std::string(error.what()).find("do not tell the size of the targets"), std::string::npos);
  }
}

}  // namespace
}  // namespace flash::calib
