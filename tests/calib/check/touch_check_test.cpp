#include "calib/check/touch_check.h"

#include <gtest/gtest.h>

#include <random>

#include "data/camera/camera.h"
#include "tests/calib/hand_eye_scene.h"
#include "tests/data/temporary_folder.h"

namespace flash::calib {
namespace {

using Mount = calib::Setup;  // testing::Test has a private member of the name Setup

Extrinsics beside_the_robot() {
  Extrinsics extrinsics;
  extrinsics.setup = Mount::eye_to_hand;
  // It looks down from 1.2 m.
  extrinsics.transform = {"base", "camera", make_pose({0.5, 0.1, 1.2}, {M_PI, 0.05, 0.1})};
  Vector6d sd;
  sd << 1e-3, 2e-3, 2e-3, 2e-3, 1e-3, 3e-3;
  extrinsics.covariance = sd.cwiseAbs2().asDiagonal();
  data::CameraIntrinsics lens;
  lens.width = 1280;
  lens.height = 720;
  lens.fx = 900;
  lens.fy = 910;
  lens.cx = 641;
  lens.cy = 355;
  lens.model = data::DistortionModel::plumb_bob;
  lens.distortion = {0.1, -0.2, 0.001, -0.002, 0.05};
  extrinsics.lens = lens;
  return extrinsics;
}

/// Six points about the table, seen by a camera at `camera` without an error.
std::vector<TouchedPoint> touched(const Eigen::Isometry3d& camera) {
  std::vector<TouchedPoint> points;
  for (const Eigen::Vector3d& place :
       {Eigen::Vector3d(0.4, 0, 0), Eigen::Vector3d(0.6, 0, 0.1), Eigen::Vector3d(0.5, 0.3, 0),
        Eigen::Vector3d(0.7, 0.2, 0.2), Eigen::Vector3d(0.3, -0.1, 0.05), Eigen::Vector3d(0.5, 0.1, 0)})
    points.push_back({place, *data::project(*beside_the_robot().lens, camera.inverse() * place)});
  return points;
}

// The chance is that of chi-square: over right calibrations, tips and pixels it is even between 0 and 1.
TEST(TouchCheck, ChancesOfRightCalibrationsAreEven) {
  constexpr int kTrials = 1000;
  const Extrinsics extrinsics = beside_the_robot();
  const TouchSettings settings{.touch_sd = 2e-3, .pixel_sd = 0.7};
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  int below[3] = {}, shift_below[3] = {}, contradicted = 0;
  double errors = 0, expected = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    Vector6d away = extrinsics.covariance.diagonal().cwiseSqrt();
    for (double& value : away) value *= normal(random);
    std::vector<TouchedPoint> points = touched(moved(extrinsics.transform.T, away));
    for (TouchedPoint& point : points) {
      for (double& x : point.place) x += settings.touch_sd * normal(random);
      for (double& x : point.pixel) x += settings.pixel_sd * normal(random);
    }
    const TouchCheck check = check_touched(extrinsics, points, settings, "points.csv");
    EXPECT_TRUE(check.judges);
    contradicted += check.contradicts;
    for (int i = 0; i < 3; ++i) {
      below[i] += check.chance < 0.25 * (i + 1) ? 1 : 0;
      shift_below[i] += check.shift_chance < 0.25 * (i + 1) ? 1 : 0;
    }
    errors += check.rms_across * check.rms_across;
    expected += check.expected_across * check.expected_across;
  }
  for (int i = 0; i < 3; ++i) {  // 3.5 deviations of 13.7 to 15.8
    EXPECT_NEAR(below[i], 250 * (i + 1), 55);
    EXPECT_NEAR(shift_below[i], 250 * (i + 1), 55);
  }
  EXPECT_LE(contradicted, 21);  // once in a hundred, and 3.5 deviations
  EXPECT_NEAR(errors / expected, 1, 0.15);
}

TEST(TouchCheck, ACameraThatMovedIsToldWithItsWay) {
  const Extrinsics extrinsics = beside_the_robot();
  Eigen::Isometry3d away = extrinsics.transform.T;
  away.translation() += Eigen::Vector3d(0.02, -0.01, 0.005);
  const TouchCheck check = check_touched(extrinsics, touched(away), {}, "points.csv");
  EXPECT_TRUE(check.contradicts);
  EXPECT_NEAR(check.shift.x(), 0.02, 1e-4);
  EXPECT_NEAR(check.shift.y(), -0.01, 1e-4);
  EXPECT_NEAR(check.shift.z(), 0.005, 2e-4);  // along the view the prior of a depth counts
  EXPECT_NEAR(check.rms_across, 0.022, 2e-3);
  EXPECT_FALSE(check_touched(extrinsics, touched(extrinsics.transform.T), {}, "points.csv").contradicts);
  EXPECT_LT(check_touched(extrinsics, touched(extrinsics.transform.T), {}, "points.csv").rms_px, 1e-9);
}

// Of three times as many points the sum of all errors hides a shift that the points tell to a millimetre.
TEST(TouchCheck, AShiftIsToldBelowTheNoiseOfManyPoints) {
  Extrinsics extrinsics = beside_the_robot();
  extrinsics.covariance *= 0.01;
  std::mt19937 random(11);
  std::normal_distribution<double> normal;
  std::vector<TouchedPoint> points;
  Eigen::Isometry3d away = extrinsics.transform.T;
  away.translation().x() += 2.5e-3;
  for (int round = 0; round < 3; ++round)
    for (TouchedPoint point : touched(away)) {
      for (double& x : point.place) x += 1e-3 * normal(random);
      for (double& x : point.pixel) x += normal(random);
      points.push_back(point);
    }
  const TouchCheck check = check_touched(extrinsics, points, {}, "points.csv");
  EXPECT_LT(check.shift_chance, 1e-4);
  EXPECT_LT(check.shift_chance, 0.1 * check.chance);
  EXPECT_TRUE(check.contradicts);
}

TEST(TouchCheck, PointsThatTellNoPlaceJudgeNothing) {
  const Extrinsics extrinsics = beside_the_robot();
  const std::vector<TouchedPoint> all = touched(extrinsics.transform.T);
  EXPECT_TRUE(check_touched(extrinsics, all, {}, "points.csv").judges);
  EXPECT_FALSE(check_touched(extrinsics, {all.front()}, {}, "points.csv").judges);
  const std::vector<TouchedPoint> same(10, all.front());
  EXPECT_FALSE(check_touched(extrinsics, same, {}, "points.csv").judges);
}

TEST(TouchCheck, PointsOfAFileAreReadOrRefusedByLine) {
  const data::TemporaryFolder folder;
  const auto error = [&](const std::string& text) {
    return data::input_error_of([&] { load_touched_points(folder.write("points.csv", text)); });
  };
  const std::vector<TouchedPoint> points =
      load_touched_points(folder.write("points.csv", "x,y,z,u,v\n0.4,0,0.1,640.5,360\n\n0.5,0,0,100,200\n"));
  ASSERT_EQ(points.size(), 2u);
  EXPECT_EQ(points[0].pixel, Eigen::Vector2d(640.5, 360));
  EXPECT_NE(error("x,y,z\n").find("line 1"), std::string::npos);
  EXPECT_NE(error("x,y,z,u,v\n").find("at least one point"), std::string::npos);
  EXPECT_NE(error("x,y,z,u,v\n1,2,3,4\n").find("line 2"), std::string::npos);
  EXPECT_NE(error("x,y,z,u,v\n1,2,3,4,nan\n").find("line 2"), std::string::npos);
}

TEST(TouchCheck, WhatItCannotJudgeIsRefused) {
  const std::vector<TouchedPoint> points = touched(beside_the_robot().transform.T);
  const auto error = [&](const Extrinsics& extrinsics, const std::vector<TouchedPoint>& of) {
    return data::input_error_of([&] { check_touched(extrinsics, of, {}, "points.csv"); });
  };
  Extrinsics other = beside_the_robot();
  other.lens.reset();
  EXPECT_NE(error(other, points).find("with a lens"), std::string::npos);
  other = beside_the_robot();
  other.setup = Mount::eye_in_hand;
  EXPECT_NE(error(other, points).find("beside the robot"), std::string::npos);
  EXPECT_NE(error(beside_the_robot(), {{{0.5, 0.1, 0}, {1e300, 2}}}).find("of the picture, 1280 x 720"),
            std::string::npos);
  EXPECT_NE(error(beside_the_robot(), std::vector<TouchedPoint>(1001, points[0])).find("at most 1,000"),
            std::string::npos);
  EXPECT_NE(error(beside_the_robot(), {{{400, 0, 1500}, {1, 2}}}).find("in metres"), std::string::npos);
}

}  // namespace
}  // namespace flash::calib
