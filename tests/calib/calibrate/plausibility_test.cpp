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

TEST(UnusualNoise, IsToldWhereNoArmErrsSoAndNoAnswerWhereNoneCould) {
  for (const auto& [millimetres, degrees, told, unusable] :
       {std::tuple(4.0, 0.9, false, false), std::tuple(6.0, 0.1, true, false),
        std::tuple(0.1, 1.5, true, false), std::tuple(18.0, 0.02, true, true),
        std::tuple(0.2, 6.8, true, true)}) {
    bool no_answer = false;
    const std::string sentence = unusual_noise({.corner = {0.1},
                                                .rotation = {degrees * M_PI / 180},
                                                .translation = {1e-3 * millimetres},
                                                .depth = {}},
                                               no_answer);
    EXPECT_EQ(!sentence.empty(), told) << millimetres;
    EXPECT_EQ(no_answer, unusable) << millimetres;
  }
}

}  // namespace
}  // namespace flash::calib
