// Pairs of poses: what a tracker says in place of pictures.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include "calib/calibrate/calibrate_pairs.h"
#include "tests/calib/pairs_of_scene.h"
#include "tests/data/temporary_folder.h"

namespace flash::calib {
namespace {

using Mount = calib::Setup;  // testing::Test has a private member of the name Setup

// Nothing closes, so nothing closes to 0.0 deg either.
TEST(Pairs, FourRandomOnesAreToldToTurnByOtherAngles) {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const auto drawn = [&] {
    return make_pose({uniform(random), uniform(random), 1 + uniform(random)},
                     M_PI / 2 * Eigen::Vector3d(uniform(random), uniform(random), uniform(random)));
  };
  std::vector<Observation> pairs(4);
  for (Observation& pair : pairs) {
    pair.pixels.resize(2, 0);
    pair.T_base_gripper = drawn();
    pair.T_camera_target = {drawn()};
  }
  const std::string said = data::input_error_of([&] { calibrate_pairs(Mount::eye_to_hand, pairs); });
  EXPECT_EQ(said.find("0.0 deg and 0 mm"), std::string::npos) << said;
  EXPECT_NE(said.find("do not tell of the same motion"), std::string::npos) << said;
}

/// Robot and target as they truly stand, but for noise of 0.05 deg and 0.5 mm, at gripper poses of turns by
/// half a circle about three axes.
HandEyeScene half_turns_scene() {
  HandEyeScene scene = protocol_scene(Mount::eye_in_hand, 0, 0, 3);
  std::mt19937 random(4);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform(-0.15, 0.15);
  const Eigen::Isometry3d first = scene.true_poses.front();
  for (std::size_t i = 0; i < scene.observations.size(); ++i) {
    const Eigen::Vector3d axis = i % 4 == 0
                                     ? Eigen::Vector3d::Zero().eval()
                                     : Eigen::Vector3d::Unit(static_cast<Eigen::Index>(i % 4) - 1).eval();
    const Eigen::Isometry3d pose =
        first * make_pose({uniform(random), uniform(random), uniform(random)}, M_PI * axis);
    Vector6d noise;
    for (Eigen::Index k = 0; k < 6; ++k) noise[k] = (k < 3 ? 5e-4 : 0.05 * M_PI / 180) * normal(random);
    scene.observations[i].T_base_gripper = moved(pose, noise);
    scene.observations[i].T_camera_target = {scene.truth.X.inverse() * pose.inverse() * scene.truth.Z};
  }
  return scene;
}

TEST(Pairs, WhoseTurnsAreAllByHalfACircleAreSolved) {
  const HandEyeScene scene = half_turns_scene();
  const Calibration result = calibrate_pairs(Mount::eye_in_hand, pairs_of(scene));
  EXPECT_TRUE(result.usable);
  const Vector6d error = motion_between(result.poses.X, scene.truth.X);
  EXPECT_LT(error.dot(result.covariance.ldlt().solve(error)), 22.5);  // 99.9 % of chi-square, 6
}

TEST(Pairs, OfAStreamAreComparedOnSomeOfThemAndAllSolved) {
  SceneSettings stream = protocol_settings(Mount::eye_in_hand);
  stream.robot_deg = 0.05;
  stream.robot_mm = 0.5;
  stream.views = 1000;
  const HandEyeScene scene = make_scene(stream, board_points(), 5);
  std::vector<Observation> pairs = pairs_of(scene);
  for (std::size_t i = 0; i < pairs.size(); ++i)
    pairs[i].T_camera_target = {scene.truth.X.inverse() * scene.true_poses[i].inverse() * scene.truth.Z};
  CalibrateSettings settings;
  settings.target_size_sd = 0;  // a size that is solved for is less known than places, and so is a lens
  settings.lens = LensKnowledge::stated;
  std::size_t most = 0;
  settings.closed_forms = {{"park",
                            [&](const std::vector<PoseLoop>& loops) -> std::optional<HandEyePoses> {
                              most = std::max(most, loops.size());
                              return park(loops);
                            }},
                           {"shah", shah}};
  const Calibration result = calibrate_pairs(Mount::eye_in_hand, pairs, settings);
  EXPECT_EQ(most, most_pairs_compared);
  EXPECT_NE(result.warnings.back().find("compared on 200 of 1000 pairs"), std::string::npos);
  const Vector6d error = motion_between(result.poses.X, scene.truth.X);
  EXPECT_LT(error.dot(result.covariance.ldlt().solve(error)), 22.5);  // 99.9 % of chi-square, 6
  // All pairs count: scatter of 0.5 mm, by the root of 1000; X and Z share it, and turns move places.
  EXPECT_LT(std::sqrt(result.repeatable.topLeftCorner<3, 3>().trace() / 3), 5 * 0.5e-3 / std::sqrt(1000.0));
}

// A camera or a target that is knocked by 8 mm half-way: told, and stated. One that stands still is not.
TEST(Pairs, OfWhichSomethingMovedHalfWayAreTold) {
  for (const Mount setup : {Mount::eye_in_hand, Mount::eye_to_hand})
    for (const bool camera : {true, false})
      for (const bool knocked : {true, false}) {
        SceneSettings settings = protocol_settings(setup);
        settings.views = 24;
        settings.robot_deg = 0.05;
        settings.robot_mm = 0.5;
        HandEyeScene scene = make_scene(settings, board_points(), 9);
        Vector6d motion = Vector6d::Zero();
        motion.head<3>() << 0.006, -0.004, 0.0035;
        if (knocked) displace(scene, 0, 12, camera, motion, 9);
        const Calibration result = calibrate_pairs(setup, pairs_of(scene));
        const bool told =
            std::any_of(result.warnings.begin(), result.warnings.end(), [](const std::string& warning) {
              return warning.starts_with("first and second half of the views put the ");
            });
        EXPECT_EQ(told, knocked) << camera;
        EXPECT_EQ(result.covariance_factor > 1, knocked);
      }
}

TEST(Pairs, WhoseTargetPosesAreInvertedAreNamed) {
  for (const Mount setup : {Mount::eye_in_hand, Mount::eye_to_hand}) {
    std::vector<Observation> pairs = pairs_of(protocol_scene(setup, 0.05, 0.5, 7));
    for (Observation& pair : pairs) pair.T_camera_target = {pair.T_camera_target.front().inverse()};
    const std::string said = data::input_error_of([&] { calibrate_pairs(setup, pairs); });
    EXPECT_EQ(said.substr(0, 33), "the target's poses are inverted: ") << said;
  }
}

TEST(Pairs, ThatMayBeInvertedInThreeWaysAreToldAllOfThem) {
  // A target whose z looks at the camera is before it in either direction of its poses.
  const Eigen::Isometry3d turned(Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitX()));
  std::vector<Observation> pairs = pairs_of(protocol_scene(Mount::eye_in_hand, 0.05, 0.5, 7));
  for (Observation& pair : pairs) pair.T_camera_target = {(pair.T_camera_target.front() * turned).inverse()};
  const std::string said = data::input_error_of([&] { calibrate_pairs(Mount::eye_in_hand, pairs); });
  EXPECT_NE(said.find("(or the poses are T_gripper_base, or those of the target T_target_camera)"),
            std::string::npos)
      << said;
}

// Noise of one side alone looks like a size: which of them it is, pairs do not tell.
TEST(Pairs, WhoseNoiseIsTheCamerasAreAnsweredAndNotCalledTheRobots) {
  for (const Mount setup : {Mount::eye_in_hand, Mount::eye_to_hand})
    for (const double camera_mm : {6.0, 10.0, 15.0, 20.0}) {
      const HandEyeScene scene = noisy_scene(setup, 0.3, camera_mm, 31);
      const Calibration result = calibrate_pairs(setup, pairs_of(scene));
      EXPECT_TRUE(result.usable) << camera_mm << ' ' << result.warnings.front();
      EXPECT_FALSE(tells_of_size(result)) << camera_mm;
      EXPECT_EQ(result.warnings.front().substr(0, 24), "robot and camera scatter") << result.warnings.front();
      EXPECT_TRUE(within_999(result, scene)) << camera_mm;
    }
}

// Both inverted close as well as they did, and so do robot and target exchanged: where the target stands
// tells it.
TEST(Pairs, WhoseTargetNoCameraSeesAreDoubted) {
  const std::string doubt = "the target is behind the camera";
  for (const Mount setup : {Mount::eye_in_hand, Mount::eye_to_hand}) {
    std::vector<Observation> pairs = pairs_of(noisy_scene(setup, 0.3, 1.0, 31));
    const auto doubted = [&] {
      const std::vector<std::string> warnings = calibrate_pairs(setup, pairs).warnings;
      return std::any_of(warnings.begin(), warnings.end(),
                         [&](const std::string& warning) { return warning.starts_with(doubt); });
    };
    EXPECT_FALSE(doubted());
    for (Observation& pair : pairs) {
      pair.T_base_gripper = pair.T_base_gripper.inverse();
      pair.T_camera_target.front() = pair.T_camera_target.front().inverse();
    }
    EXPECT_TRUE(setup == Mount::eye_in_hand || doubted());
  }
}

/// Of pairs in which the camera or the target moves by `mm` before one, what is said of it.
std::string told_of_motion(std::vector<Observation> pairs, Mount setup, bool of_target, std::size_t before,
                           double mm, bool& usable) {
  const Eigen::Isometry3d D = make_pose({1e-3 * mm, 0, 0}, {2e-3, 0, 1e-3});
  for (std::size_t i = before; i < pairs.size(); ++i) {
    Eigen::Isometry3d& C = pairs[i].T_camera_target.front();
    C = of_target ? Eigen::Isometry3d(C * D) : Eigen::Isometry3d(D * C);
  }
  const Calibration result = calibrate_pairs(setup, pairs);
  usable = result.usable;
  for (const std::string& warning : result.warnings)
    if (warning.find(" moved by ") != std::string::npos) return warning;
  return "";
}

// Knocks that leave two pairs and more on either side; of pairs that nothing moved in, none is claimed.
TEST(Pairs, BetweenWhichTheCameraMovedAreNoAnswer) {
  for (const Mount setup : {Mount::eye_in_hand, Mount::eye_to_hand})
    for (const bool of_target : {false, true}) {
      const std::vector<Observation> pairs = pairs_of(noisy_scene(setup, 0.3, 1.0, 31));
      bool usable = false;
      for (const std::size_t before : {std::size_t{3}, pairs.size() / 2, pairs.size() - 3}) {
        const std::string told = told_of_motion(pairs, setup, of_target, before, 20, usable);
        EXPECT_NE(told.find("before " + pairs[before].image + ":"), std::string::npos)
            << to_string(setup) << of_target << before << told;
        // Of halves the deviations grow until they hold both.
        EXPECT_EQ(usable, before == pairs.size() / 2) << to_string(setup) << of_target << before;
      }
      EXPECT_EQ(told_of_motion(pairs, setup, of_target, pairs.size(), 20, usable), "");
      EXPECT_TRUE(usable);
    }
}

// Copies of a pair tell nothing anew, and outliers move means alone.
TEST(Pairs, ThatAreCopiesOrOutliersClaimNoMotion) {
  bool usable = false;
  for (unsigned seed = 201; seed < 211; ++seed) {
    const Mount setup = seed % 2 ? Mount::eye_in_hand : Mount::eye_to_hand;
    const std::vector<Observation> pairs = pairs_of(noisy_scene(setup, 0.3, 1.0, seed));
    std::vector<Observation> copies, spoilt = pairs;
    for (const Observation& pair : pairs) copies.insert(copies.end(), 3, pair);
    EXPECT_EQ(told_of_motion(copies, setup, false, copies.size(), 0, usable), "") << seed;
    std::mt19937 random(seed);
    for (int k = 0; k < 5; ++k)
      spoilt[random() % spoilt.size()].T_camera_target.front().translation() +=
          Eigen::Vector3d(0.3, -0.2, 0.1) * (1 + k);
    EXPECT_EQ(told_of_motion(spoilt, setup, false, spoilt.size(), 0, usable), "") << seed;
  }
}

TEST(Pairs, InWhichNothingMovedClaimNoMotion) {
  int claimed = 0;
  bool usable = false;
  for (unsigned seed = 101; seed < 141; ++seed) {
    const Mount setup = seed % 2 ? Mount::eye_in_hand : Mount::eye_to_hand;
    const std::vector<Observation> pairs = pairs_of(noisy_scene(setup, 0.3, 1.0, seed));
    claimed += !told_of_motion(pairs, setup, false, pairs.size(), 0, usable).empty();
  }
  EXPECT_LE(claimed, 1);  // what gains 20 more than a hundred orders do is chance in fewer than one in 1,000
}

// Of a camera in the hand the target may stand before it either way; how far it is tells it.
TEST(Pairs, ThatAreExchangedAreDoubtedByTheirDistances) {
  std::vector<Observation> pairs = pairs_of(noisy_scene(Mount::eye_in_hand, 0.3, 1.0, 31));
  const auto doubted = [&] {
    const std::vector<std::string> warnings = calibrate_pairs(Mount::eye_in_hand, pairs).warnings;
    return std::any_of(warnings.begin(), warnings.end(), [&](const std::string& warning) {
      return warning.find("exchanged? Such pairs close as well") != std::string::npos;
    });
  };
  EXPECT_FALSE(doubted());
  for (Observation& pair : pairs) std::swap(pair.T_base_gripper, pair.T_camera_target.front());
  EXPECT_TRUE(doubted());
}

}  // namespace
}  // namespace flash::calib
