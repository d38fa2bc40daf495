#include "calib/check/same_place.h"

#include <gtest/gtest.h>

#include <random>

#include "data/files/error.h"
#include "tests/calib/hand_eye_scene.h"
#include "tests/data/temporary_folder.h"

namespace flash::calib {
namespace {

using Mount = calib::Setup;  // testing::Test has a private member of the name Setup

Extrinsics extrinsics_at(const Vector6d& away) {
  Extrinsics extrinsics;
  extrinsics.setup = Mount::eye_to_hand;
  extrinsics.transform = {"base", "camera", moved(make_pose({0.6, 0.1, 0.3}, {0.1, 2, 0.3}), away)};
  Vector6d sd;
  sd << 1e-3, 1e-3, 2e-3, 2e-3, 2e-3, 1e-3;
  extrinsics.covariance = sd.cwiseAbs2().asDiagonal();
  return extrinsics;
}

// The chance is that of chi-square: over many cameras that stand still it is even between 0 and 1.
TEST(SamePlace, ChancesOfCamerasThatStandStillAreEven) {
  constexpr int kTrials = 1000;
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  const auto drawn = [&] {
    Vector6d away = extrinsics_at(Vector6d::Zero()).covariance.diagonal().cwiseSqrt();
    for (double& value : away) value *= normal(random);
    return extrinsics_at(away);
  };
  int below[3] = {};
  for (int trial = 0; trial < kTrials; ++trial) {
    const Placement found = placement(drawn(), drawn(), "a.json", "b.json");
    EXPECT_EQ(found.moved, found.chance < 0.01);
    for (int i = 0; i < 3; ++i) below[i] += found.chance < 0.25 * (i + 1) ? 1 : 0;
  }
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(below[i], 250 * (i + 1), 50);  // 3.5 deviations of 13.7 to 15.8
}

TEST(SamePlace, CameraThatMovedByTenDeviationsIsToldAsMoved) {
  Vector6d away = Vector6d::Zero();
  away[0] = 14e-3;  // both are known to 1 mm
  const Placement found = placement(extrinsics_at(Vector6d::Zero()), extrinsics_at(away), "a.json", "b.json");
  EXPECT_TRUE(found.moved);
  EXPECT_NEAR(found.chi_square, 98, 1e-6);  // 14^2 / 2
  EXPECT_TRUE(describe(found).starts_with("moved: the two put the camera 14.00 mm and 0.000 deg apart"))
      << describe(found);
}

TEST(SamePlace, OtherSetupsAndFilesWithoutCovarianceAreRefused) {
  const Extrinsics first = extrinsics_at(Vector6d::Zero());
  Extrinsics second = first;
  second.setup = Mount::eye_in_hand;
  EXPECT_EQ(data::input_error_of([&] { placement(first, second, "a.json", "b.json"); }),
            "b.json: found eye-in-hand, expected eye-to-hand as in a.json");
  Extrinsics bare = first;
  bare.covariance.setZero();
  EXPECT_NE(data::input_error_of([&] { placement(bare, bare, "a.json", "b.json"); }).find("no covariance"),
            std::string::npos);
}

}  // namespace
}  // namespace flash::calib
