// Every convention in which robots write three angles, read as another.
#include <gtest/gtest.h>

#include "calib/calibrate/calibrate.h"
#include "data/files/error.h"
#include "data/motion/rotation_angles.h"
#include "tests/calib/arm_scene.h"

namespace flash::calib {
namespace {

using Mount = calib::Setup;  // testing::Test has a private member of the name Setup

/// The three numbers that this convention writes for a rotation.
Eigen::Vector3d written(const Eigen::Matrix3d& R, const std::string& order) {
  if (order == data::kRotationVector) return rotation_log(R);
  const bool turning = order.front() < 'a';
  const auto axis = [&](std::size_t k) {
    return static_cast<Eigen::Index>(order[k] - (turning ? 'X' : 'x'));
  };
  // Eigen's are about turning axes: R = R_i(a_0) R_j(a_1) R_k(a_2).
  if (turning) return R.eulerAngles(axis(0), axis(1), axis(2));
  return R.eulerAngles(axis(2), axis(1), axis(0)).reverse();
}

class Conventions : public testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(Angles, Conventions, testing::ValuesIn(data::angle_orders()),
                         [](const auto& order) { return order.param; });

TEST_P(Conventions, AreReadAsTheyAreWritten) {
  std::mt19937 random(1);
  for (int i = 0; i < 20; ++i) {
    const Eigen::Matrix3d R = Eigen::Quaterniond::UnitRandom().toRotationMatrix();
    // Rounding is amplified near a gimbal lock; 20 draws stay 1e-3 away from it.
    EXPECT_LT((data::rotation_from_angles(written(R, GetParam()), GetParam()) - R).norm(), 1e-9);
  }
}

TEST_P(Conventions, TakenForFixedXyzAreNamed) {
  for (const Mount setup : {Mount::eye_in_hand, Mount::eye_to_hand}) {
    SceneSettings settings = protocol_settings(setup);
    settings.robot_deg = 0.05;
    settings.robot_mm = 0.5;
    HandEyeScene scene = make_scene(settings, board_points(), 6);
    CalibrateSettings calibrate_settings;
    for (Observation& o : scene.observations) {
      calibrate_settings.angles.push_back(written(o.T_base_gripper.linear(), GetParam()));
      o.T_base_gripper.linear() = data::rotation_from_angles(calibrate_settings.angles.back());
    }
    const auto solve = [&] {
      return calibrate(setup, scene.camera, scene.points, grid_symmetries(scene.points), scene.observations,
                       calibrate_settings);
    };
    if (GetParam() == "xyz") {
      EXPECT_TRUE(solve().usable);
      continue;
    }
    try {
      solve();
      FAIL() << "accepted";
    } catch (const data::InputError& error) {
      EXPECT_NE(std::string(error.what()).find("(--angles " + GetParam() + ")"), std::string::npos)
          << error.what();
    }
  }
}

// What another convention explains to centimetres alone is not offered as the cause.
TEST(ConventionCheck, OffersNothingWhereNothingCloses) {
  for (unsigned seed = 1; seed < 5; ++seed) {
    HandEyeScene scene = make_scene(protocol_settings(Mount::eye_in_hand), board_points(), seed);
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> uniform(-1, 1);
    CalibrateSettings settings;
    for (Observation& o : scene.observations) {
      settings.angles.emplace_back(uniform(random), uniform(random), uniform(random));
      o.T_base_gripper.linear() = data::rotation_from_angles(settings.angles.back());
    }
    try {
      const Calibration result = calibrate(Mount::eye_in_hand, scene.camera, scene.points,
                                           grid_symmetries(scene.points), scene.observations, settings);
      EXPECT_FALSE(result.usable);
      EXPECT_TRUE(result.warnings.front().starts_with("robot and camera do not tell"))
          << result.warnings.front();
    } catch (const data::InputError& error) {
      EXPECT_NE(std::string(error.what()).find("robot and camera do not tell of the same motion"),
                std::string::npos)
          << error.what();
    }
  }
}

// Angles of an arm that turns little close to a few degrees in any order: the answer is none, and says why.
TEST(ConventionCheck, AnswerThatIsNoneNamesTheColumns) {
  for (const Mount setup : {Mount::eye_in_hand, Mount::eye_to_hand}) {
    int named = 0;
    for (unsigned seed = 71; seed < 75; ++seed) {
      SceneSettings scene_settings = protocol_settings(setup);
      scene_settings.robot_deg = 0.05;
      scene_settings.robot_mm = 0.3;
      HandEyeScene scene =
          make_arm_scene(scene_settings, {.zero_deg = 0.1, .length_mm = 0.3}, 0.15, board_points(), seed);
      CalibrateSettings settings;
      for (Observation& o : scene.observations) {
        settings.angles.push_back(written(o.T_base_gripper.linear(), "ZYX"));
        o.T_base_gripper.linear() = data::rotation_from_angles(settings.angles.back());
      }
      std::string said;
      try {
        const Calibration result = calibrate(setup, scene.camera, scene.points, grid_symmetries(scene.points),
                                             scene.observations, settings);
        EXPECT_FALSE(result.usable) << seed;
        if (!result.warnings.empty()) said = result.warnings.front();
      } catch (const data::InputError& error) {
        said = error.what();
      }
      named += said.find("--angles ZYX") != std::string::npos;
    }
    EXPECT_GE(named, 3);
  }
}

}  // namespace
}  // namespace flash::calib
