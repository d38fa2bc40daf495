#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <functional>

#include "calib/calibrate/calibrate.h"
#include "data/files/error.h"
#include "data/motion/rotation_angles.h"
#include "tests/calib/arm_scene.h"

namespace flash::calib {
namespace {

HandEyeScene scene_of(Setup setup, unsigned seed, int views = 20) {
  SceneSettings settings = protocol_settings(setup);
  settings.views = views;
  settings.robot_deg = 0.05;
  settings.robot_mm = 0.5;
  HandEyeScene scene = make_scene(settings, board_points(), seed);
  for (std::size_t i = 0; i < scene.observations.size(); ++i)
    scene.observations[i].image = std::to_string(i) + ".png";
  return scene;
}

Calibration calibrated(const HandEyeScene& scene, const CalibrateSettings& settings = {}) {
  return calibrate(scene.settings.setup, scene.camera, scene.points, grid_symmetries(scene.points),
                   scene.observations, settings);
}

/// The sentence with which the scene is refused; empty where it is not.
std::string refusal(const HandEyeScene& scene, const CalibrateSettings& settings = {}) {
  try {
    calibrated(scene, settings);
    return {};
  } catch (const data::InputError& error) {
    return error.what();
  }
}

// Within four of its own standard deviations, and a robot's noise over the square root of the views.
void expect_right(const Calibration& result, const HandEyeScene& scene) {
  const Vector6d error = motion_between(result.poses.X, scene.truth.X);
  const Vector6d sd = result.covariance.diagonal().cwiseSqrt();
  EXPECT_TRUE((error.cwiseAbs().array() < 4 * sd.array()).all())
      << error.transpose() << " / " << sd.transpose();
  EXPECT_LT(sd.head<3>().maxCoeff(), 2e-3);
  EXPECT_TRUE(result.usable);
}

/// What the detector would have read from a board seen from its other end.
void flip(Observation& observation, const Symmetry& turn) {
  for (int& point : observation.points) point = turn.permutation[static_cast<std::size_t>(point)];
  for (Eigen::Isometry3d& T : observation.T_camera_target) T = T * turn.turn.inverse();
}

class Traps : public testing::TestWithParam<Setup> {};
INSTANTIATE_TEST_SUITE_P(HandEye, Traps, testing::Values(Setup::eye_in_hand, Setup::eye_to_hand));

TEST_P(Traps, CleanSetPassesWithoutWarnings) {
  const HandEyeScene scene = scene_of(GetParam(), 1);
  const Calibration result = calibrated(scene);
  expect_right(result, scene);
  EXPECT_TRUE(result.warnings.empty()) << result.warnings.front();
  EXPECT_EQ(result.used.size(), scene.observations.size());
}

TEST_P(Traps, InvertedPosesAreNamed) {
  HandEyeScene scene = scene_of(GetParam(), 2);
  for (Observation& o : scene.observations) o.T_base_gripper = o.T_base_gripper.inverse();
  EXPECT_TRUE(refusal(scene).starts_with("the poses are inverted")) << refusal(scene);
}

TEST_P(Traps, SwappedSetupIsNamed) {
  HandEyeScene scene = scene_of(GetParam(), 3);
  const bool in_hand = GetParam() == Setup::eye_in_hand;
  scene.settings.setup = in_hand ? Setup::eye_to_hand : Setup::eye_in_hand;
  EXPECT_TRUE(refusal(scene).starts_with(in_hand ? "the setup is eye-in-hand" : "the setup is eye-to-hand"))
      << refusal(scene);
}

TEST_P(Traps, PairingOffByOneIsNamed) {
  HandEyeScene scene = scene_of(GetParam(), 4);
  for (std::size_t i = scene.observations.size() - 1; i > 0; --i)
    scene.observations[i].T_base_gripper = scene.observations[i - 1].T_base_gripper;
  EXPECT_TRUE(refusal(scene).starts_with("images and poses are paired off by one")) << refusal(scene);
}

TEST_P(Traps, ReverseOrderIsNamed) {
  HandEyeScene scene = scene_of(GetParam(), 15);
  std::vector<Eigen::Isometry3d> poses;
  for (const Observation& o : scene.observations) poses.push_back(o.T_base_gripper);
  for (Observation& o : scene.observations) {
    o.T_base_gripper = poses.back();
    poses.pop_back();
  }
  EXPECT_TRUE(refusal(scene).starts_with("the poses are in reverse order")) << refusal(scene);
}

TEST_P(Traps, QuaternionsInAnotherOrderAreNamed) {
  HandEyeScene scene = scene_of(GetParam(), 16);
  for (Observation& o : scene.observations) {
    const Eigen::Quaterniond q(o.T_base_gripper.linear());
    // A file of w x y z, read as x y z w.
    o.T_base_gripper.linear() = Eigen::Quaterniond(q.z(), q.w(), q.x(), q.y()).toRotationMatrix();
  }
  EXPECT_TRUE(refusal(scene).starts_with("quaternions are w x y z where x y z w was expected"))
      << refusal(scene);
}

TEST_P(Traps, TargetOfTenTimesTheSizeIsNamedWithItsSize) {
  for (const double factor : {10.0, 2.5, 0.1}) {
    HandEyeScene scene = scene_of(GetParam(), 17);
    scene.points *= factor;
    for (Observation& o : scene.observations) o.T_camera_target.front().translation() *= factor;
    const std::string said = refusal(scene);
    double size = 0;
    ASSERT_EQ(std::sscanf(said.c_str(), "the target is %lf times as large as stated", &size), 1)
        << factor << ": " << said;
    // The robot's noise over how far it moves, 0.5 mm of 0.1 m, and its turns at the length of its arm.
    EXPECT_NEAR(size * factor, 1, 0.01);
  }
}

TEST_P(Traps, PlacesInWrongColumnsAreNoAnswer) {
  HandEyeScene scene = scene_of(GetParam(), 21);
  for (Observation& o : scene.observations) {
    Eigen::Isometry3d& pose = o.T_base_gripper;
    pose.translation() = Eigen::Vector3d(pose.translation().reverse());
  }
  EXPECT_NE(refusal(scene).find("do not tell of the same motion"), std::string::npos) << refusal(scene);
}

TEST_P(Traps, MillimetresAreNamed) {
  HandEyeScene scene = scene_of(GetParam(), 5);
  for (Observation& o : scene.observations) o.T_base_gripper.translation() *= 1e3;
  EXPECT_TRUE(refusal(scene).starts_with("translations of the robot are millimetres")) << refusal(scene);
}

TEST_P(Traps, DegreesForRadiansAndOrdersOfAnglesAreNamed) {
  struct Case {
    std::function<Eigen::Vector3d(const Eigen::Matrix3d&)> written;
    const char* start;
  };
  // Angles that a file would hold: found by solving R(angles) = R, here from Eigen's decomposition.
  const auto xyz = [](const Eigen::Matrix3d& R) -> Eigen::Vector3d {
    return R.eulerAngles(2, 1, 0).reverse();
  };
  const auto zyx = [](const Eigen::Matrix3d& R) -> Eigen::Vector3d {
    return R.eulerAngles(0, 1, 2).reverse();
  };
  const Case cases[] = {
      {[&](const Eigen::Matrix3d& R) -> Eigen::Vector3d { return xyz(R) * 180 / M_PI; },
       "angles are degrees where radians were expected"},
      {zyx, "the three angles turn about fixed zyx, not fixed xyz"},
      {[](const Eigen::Matrix3d& R) { return rotation_log(R); }, "the three angles are a rotation vector"}};
  for (const Case& trap : cases) {
    HandEyeScene scene = scene_of(GetParam(), 6);
    CalibrateSettings settings;
    for (Observation& o : scene.observations) {
      const Eigen::Vector3d angles = trap.written(o.T_base_gripper.linear());
      settings.angles.push_back(angles);
      o.T_base_gripper.linear() = data::rotation_from_angles(angles);
    }
    EXPECT_TRUE(refusal(scene, settings).starts_with(trap.start)) << refusal(scene, settings);
  }
}

/// Refused, or an answer that says of itself that it is none.
bool refused(const HandEyeScene& scene, const CalibrateSettings& settings = {}) {
  try {
    const Calibration result = calibrated(scene, settings);
    return !result.usable && !result.warnings.empty();
  } catch (const data::InputError&) {
    return true;
  }
}

/// An arm that turns little about each axis: its poses, mixed up, still close to a few degrees.
HandEyeScene small_turns(Setup setup, unsigned seed) {
  SceneSettings settings = protocol_settings(setup);
  settings.robot_deg = 0.05;
  settings.robot_mm = 0.3;
  return make_arm_scene(settings, {.zero_deg = 0.1, .length_mm = 0.3}, 0.15, board_points(), seed);
}

TEST_P(Traps, PosesInAnyOrderAreNoAnswer) {
  for (unsigned seed = 61; seed < 65; ++seed) {
    HandEyeScene scene = small_turns(GetParam(), seed);
    ASSERT_FALSE(refused(scene)) << seed;
    std::vector<Eigen::Isometry3d> poses;
    for (const Observation& o : scene.observations) poses.push_back(o.T_base_gripper);
    std::mt19937 random(seed);
    std::shuffle(poses.begin(), poses.end(), random);
    for (std::size_t i = 0; i < poses.size(); ++i) scene.observations[i].T_base_gripper = poses[i];
    EXPECT_TRUE(refused(scene)) << seed;
  }
}

TEST_P(Traps, AnglesInWrongColumnsAreNoAnswer) {
  // A about z, then B about the new y, then C about the new x, read as turns about fixed x, y, z.
  for (unsigned seed = 71; seed < 75; ++seed) {
    HandEyeScene scene = small_turns(GetParam(), seed);
    CalibrateSettings settings;
    for (Observation& o : scene.observations) {
      const Eigen::Vector3d kuka = o.T_base_gripper.linear().eulerAngles(2, 1, 0);
      settings.angles.push_back(kuka);
      o.T_base_gripper.linear() = data::rotation_from_angles(kuka);
    }
    EXPECT_TRUE(refused(scene, settings)) << seed;
  }
}

TEST_P(Traps, NumbersAtRandomAreNoAnswer) {
  for (unsigned seed = 81; seed < 85; ++seed) {
    HandEyeScene scene = scene_of(GetParam(), seed);
    std::mt19937 random(seed);
    std::normal_distribution<double> normal;
    for (Observation& o : scene.observations) {
      Vector6d wrong;
      for (int k = 0; k < 6; ++k) wrong[k] = normal(random) * (k < 3 ? 0.1 : 0.2);
      o.T_base_gripper = moved(scene.true_poses.front(), wrong);
    }
    EXPECT_TRUE(refused(scene)) << seed;
  }
}

TEST_P(Traps, WrongSquareSizeIsMeasured) {
  HandEyeScene scene = scene_of(GetParam(), 7);
  scene.points /= 1.08;
  for (Observation& o : scene.observations) o.T_camera_target.front().translation() /= 1.08;
  const Calibration result = calibrated(scene);
  EXPECT_FALSE(result.usable);
  ASSERT_TRUE(result.size && result.size->wanted);
  EXPECT_NEAR(result.size->wanted->estimate, 1.08, 4 * result.size->wanted->sd);
  EXPECT_LT(result.size->wanted->sd, 0.01);
  EXPECT_TRUE(result.warnings.front().starts_with("the estimated size of the target is 1.0"))
      << result.warnings.front();
}

TEST_P(Traps, FortyPercentFlippedBoardsArePutRight) {
  HandEyeScene scene = scene_of(GetParam(), 8);
  const std::vector<Symmetry> symmetries = grid_symmetries(scene.points);
  ASSERT_EQ(symmetries.size(), 2U);
  for (std::size_t i = 0; i < scene.observations.size(); ++i)
    if (i % 5 < 2) flip(scene.observations[i], symmetries[1]);
  const Calibration result = calibrated(scene);
  expect_right(result, scene);
  EXPECT_EQ(result.selection.renumbered, 8);
  EXPECT_EQ(result.used.size(), scene.observations.size());
}

TEST_P(Traps, PicturesTurnedByHalfATurnAreLeftOutByName) {
  HandEyeScene scene = scene_of(GetParam(), 18);
  for (const std::size_t i : {2U, 9U, 14U}) {
    Observation& o = scene.observations[i];
    const Eigen::Vector2d last(scene.camera.width - 1, scene.camera.height - 1);
    o.pixels = (-o.pixels).colwise() + last;
    o.T_camera_target = {
        fitted_pose(scene.camera, scene.points, o.pixels,
                    Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitZ()) * o.T_camera_target.front())};
  }
  const Calibration result = calibrated(scene);
  expect_right(result, scene);
  EXPECT_EQ(result.used.size(), scene.observations.size() - 3);
  EXPECT_EQ(result.views[9].reason, "the picture is turned by 180 deg");
}

TEST_P(Traps, ThirtyPercentOutliersAreRejectedByName) {
  HandEyeScene scene = scene_of(GetParam(), 9);
  std::mt19937 random(9);
  std::normal_distribution<double> normal;
  for (std::size_t i = 0; i < 6; ++i) {
    Vector6d wrong;
    for (int k = 0; k < 6; ++k) wrong[k] = normal(random) * (k < 3 ? 0.05 : 0.1);
    Observation& o = scene.observations[3 * i];
    o.T_base_gripper = moved(o.T_base_gripper, wrong);
  }
  const Calibration result = calibrated(scene);
  expect_right(result, scene);
  EXPECT_EQ(result.used.size(), 14U);
  for (std::size_t i = 0; i < 20; ++i) {
    EXPECT_EQ(result.views[i].used, i % 3 != 0 || i >= 18) << i;
    EXPECT_EQ(result.views[i].reason.empty(), result.views[i].used);
  }
}

TEST_P(Traps, CopiesCountOnce) {
  HandEyeScene scene = scene_of(GetParam(), 10);
  const Calibration once = calibrated(scene);
  for (int i = 0; i < 10; ++i) scene.observations.push_back(scene.observations[static_cast<std::size_t>(i)]);
  const Calibration twice = calibrated(scene);
  EXPECT_EQ(twice.used.size(), 20U);
  EXPECT_EQ(twice.views[20].reason, "a copy of 0.png");
  EXPECT_EQ(twice.selection.views[20].copy_of, 0);
  // The seed differs, and noise levels are iterated until the deviance stands still to 1e-3: with 60 numbers
  // each their logarithms are then right to sqrt(1e-3 / 120), and variances to twice that.
  EXPECT_LT((once.covariance - twice.covariance).norm(), 1e-2 * once.covariance.norm());
}

/// The scene seen from these poses of its robot.
void see_from(const std::vector<Eigen::Isometry3d>& poses, HandEyeScene& scene) {
  const Eigen::Isometry3d& X = scene.truth.X;
  const Eigen::Isometry3d& Z = scene.truth.Z;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    Observation& o = scene.observations[i];
    o.T_base_gripper = poses[i];
    o.T_camera_target = {X.inverse() * pose_loop(scene.settings.setup, poses[i], X).G.inverse() * Z};
  }
}

TEST_P(Traps, RobotThatDoesNotTurnIsRefused) {
  HandEyeScene scene = scene_of(GetParam(), 19);
  std::vector<Eigen::Isometry3d> poses(scene.observations.size(), scene.true_poses.front());
  for (std::size_t i = 0; i < poses.size(); ++i)
    poses[i].translation() += Eigen::Vector3d(0.01, -0.005, 0.007) * static_cast<double>(i * i % 7);
  see_from(poses, scene);
  EXPECT_TRUE(refusal(scene).starts_with("the gripper turns by no more than")) << refusal(scene);
  see_from(std::vector<Eigen::Isometry3d>(poses.size(), poses.front()), scene);
  EXPECT_TRUE(refusal(scene).starts_with("the robot does not move in any row")) << refusal(scene);
}

TEST_P(Traps, FourViewsAreSolvedAndSaidToBeFew) {
  const Calibration result = calibrated(scene_of(GetParam(), 20, 4));
  ASSERT_FALSE(result.warnings.empty());
  EXPECT_TRUE(std::any_of(result.warnings.begin(), result.warnings.end(), [](const std::string& warning) {
    return warning.starts_with("4 views: noise levels and uncertainty are themselves uncertain");
  })) << result.warnings.front();
}

TEST_P(Traps, ThreeViewsAreRefused) {
  EXPECT_TRUE(refusal(scene_of(GetParam(), 12, 3)).starts_with("3 of 3 views can be used: at least 4"));
}

TEST_P(Traps, ViewsWithoutTargetAreNamed) {
  HandEyeScene scene = scene_of(GetParam(), 13);
  scene.observations[4].T_camera_target.clear();
  const Calibration result = calibrated(scene);
  expect_right(result, scene);
  EXPECT_EQ(result.views[4].reason, "the target was not found");
}

TEST(PlanarPose, SecondPlanarPoseIsChosenWhereItIsTheRightOne) {
  SceneSettings settings = protocol_settings(Setup::eye_to_hand);
  settings.robot_deg = 0.05;
  settings.robot_mm = 0.5;
  HandEyeScene scene = make_scene(settings, tag_points(), 14);
  for (std::size_t i = 0; i < scene.observations.size(); i += 3) {
    // The mirror image of the tilt about the line of sight, first in the list.
    std::vector<Eigen::Isometry3d>& poses = scene.observations[i].T_camera_target;
    const Eigen::Vector3d sight = poses.front().translation().normalized();
    const Eigen::Vector3d normal = poses.front().linear().col(2);
    Eigen::Isometry3d mirrored = poses.front();
    mirrored.linear() = rotation_exp(2 * normal.cross(sight).normalized() * std::acos(normal.dot(sight))) *
                        poses.front().linear();
    poses.insert(poses.begin(), mirrored);
  }
  const Calibration result = calibrate(Setup::eye_to_hand, scene.camera, scene.points,
                                       {grid_symmetries(scene.points).front()}, scene.observations);
  EXPECT_GE(result.used.size(), 19U);
  const Vector6d error = motion_between(result.poses.X, scene.truth.X);
  EXPECT_LT(error.head<3>().norm(), 5e-3);
}

}  // namespace
}  // namespace flash::calib
