#include "calib/calibrate/plausibility.h"

#include <gtest/gtest.h>

#include "tests/calib/hand_eye_scene.h"

namespace flash::calib {
namespace {

const NoiseLevels kOrdinary = {.corner = {0.1}, .rotation = {0.001}, .translation = {0.0005}, .depth = {}};

TEST(Plausibility, PlacesThatAreWrongAreNotMadeUpForByTurnsThatAreRight) {
  const HandEyeScene scene = protocol_scene(Setup::eye_in_hand, 0, 0, 1);
  EXPECT_EQ(implausible_noise(kOrdinary, scene.observations), "");
  NoiseLevels wrong = kOrdinary;
  wrong.translation = {0.1};  // an axis, where the robot moves by some 0.2 m
  const std::string said = implausible_noise(wrong, scene.observations);
  EXPECT_NE(said.find("would have to be wrong by 173.2 mm and 0.10 deg"), std::string::npos) << said;
}

TEST(Plausibility, RobotThatOnlyTurnsMayBeWrongByMoreThanItMoves) {
  HandEyeScene scene = protocol_scene(Setup::eye_in_hand, 0, 0, 1);
  for (Observation& o : scene.observations) o.T_base_gripper.translation().setZero();
  EXPECT_EQ(implausible_noise(kOrdinary, scene.observations), "");
}

}  // namespace
}  // namespace flash::calib
