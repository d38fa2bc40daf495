#include "calib/detect/intrinsics.h"

#include <gtest/gtest.h>

#include <random>

#include "calib/dataset/target_shape.h"
#include "data/files/error.h"
#include "tests/calib/rendered_view.h"
#include "tests/data/temporary_folder.h"

namespace flash::calib {
namespace {

data::CameraIntrinsics lens() {
  data::CameraIntrinsics camera = small_camera();
  camera.fx = 612;
  camera.fy = 613.5;
  camera.cx = 322;
  camera.cy = 238;
  camera.model = data::DistortionModel::plumb_bob;
  camera.distortion = {-0.2, 0.06, 0.0008, -0.0005, 0};
  return camera;
}

std::vector<Observation> views(const Target& target, int count, double tilt, double noise, unsigned seed,
                               const Warp& warp = Warp::Zero()) {
  const Eigen::Matrix3Xd flat = target_points(target);
  const Eigen::Matrix3Xd points = shaped(flat, target_bows(flat), {.warp = warp});
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(0, noise);
  std::vector<Observation> list;
  for (int v = 0; v < count; ++v) {
    const Eigen::Isometry3d pose = random_view(target, lens(), 0.3, 0.5, tilt, random);
    Observation view;
    view.image = std::to_string(v);
    view.pixels.resize(2, points.cols());
    for (Eigen::Index i = 0; i < points.cols(); ++i) {
      view.points.push_back(static_cast<int>(i));
      view.pixels.col(i) =
          *data::project(lens(), pose * points.col(i)) + Eigen::Vector2d(normal(random), normal(random));
    }
    list.push_back(std::move(view));
  }
  return list;
}

// Errors over their standard deviations, squared: one on the average where the standard deviations are true.
TEST(Intrinsics, StandardDeviationsAreTrue) {
  const Target target = parse_target("chessboard:9x6:0.025");
  const IntrinsicsVector truth = to_vector(lens());
  double sum = 0;
  int count = 0;
  for (unsigned seed = 0; seed < 12; ++seed) {
    const IntrinsicsEstimate estimate =
        calibrate_intrinsics(target, views(target, 12, 0.7, 0.1, seed), 640, 480);
    EXPECT_NEAR(estimate.rms, 0.1 * std::sqrt(2.0), 0.01);
    const IntrinsicsVector found = to_vector(estimate.camera);
    for (int i = 0; i < 4; ++i) {
      sum += std::pow((found[i] - truth[i]) / estimate.sd[i], 2);
      ++count;
    }
    EXPECT_GT(estimate.corner_sd, 0);
  }
  // 12 trials of 4 unknowns, strongly correlated in pairs: as 24 free ones, chi2 / 24 lies in 0.5 to 1.7 (95
  // %).
  EXPECT_GT(sum / count, 0.4);
  EXPECT_LT(sum / count, 1.8);
}

// A print of 200 x 125 mm whose middle stands 0.8 mm behind its left and right ends: of what is usual, 1.3
// sd. Its corners are 0.5 mm before and behind by turns.
TEST(Intrinsics, TheWarpOfTheTargetIsNotTakenForTheLens) {
  const Target target = parse_target("chessboard:9x6:0.025");
  const Warp warp(8e-4, -3e-4, 5e-4);
  const IntrinsicsVector truth = to_vector(lens());
  double sum = 0, of_warp = 0;
  constexpr unsigned kTrials = 12;
  for (unsigned seed = 0; seed < kTrials; ++seed) {
    const IntrinsicsEstimate estimate =
        calibrate_intrinsics(target, views(target, 12, 0.7, 0.1, 100 + seed, warp), 640, 480);
    EXPECT_NEAR(estimate.rms, 0.1 * std::sqrt(2.0), 0.01);
    sum += ((to_vector(estimate.camera) - truth).head<4>().array() / estimate.sd.head<4>().array())
               .square()
               .sum();
    of_warp += ((estimate.warp.estimate - warp).array() / estimate.warp.sd.array()).square().sum();
    EXPECT_LT(estimate.warp.sd.maxCoeff(), 1e-4);
  }
  // As above; 12 trials of 3 unknowns: chi2 / 36 lies in 0.6 to 1.5 (95 %).
  EXPECT_LT(sum / (4 * kTrials), 1.8);
  EXPECT_GT(of_warp / (kWarp * kTrials), 0.4);
  EXPECT_LT(of_warp / (kWarp * kTrials), 1.8);
}

// Edges that stand 0.3 px inwards, as of pictures with a gamma: the markers look smaller, and farther away.
TEST(Intrinsics, EdgesThatStandInwardsAreNotTakenForTheLens) {
  const Target target = parse_target("aruco_grid:5x4:0.03:0.01:DICT_4X4_50");
  const IntrinsicsVector truth = to_vector(lens());
  double sum = 0, of_edges = 0;
  constexpr unsigned kTrials = 12;
  for (unsigned seed = 0; seed < kTrials; ++seed) {
    std::vector<Observation> list = views(target, 12, 0.7, 0.1, 300 + seed);
    for (Observation& view : list) {
      view.outward = outward_motion(target.kind, view.pixels);
      view.pixels -= 0.3 * view.outward;
    }
    const IntrinsicsEstimate estimate = calibrate_intrinsics(target, list, 640, 480);
    ASSERT_TRUE(estimate.edges);
    EXPECT_LT(estimate.edges->sd, 0.02);
    of_edges += std::pow((estimate.edges->estimate + 0.3) / estimate.edges->sd, 2);
    sum += ((to_vector(estimate.camera) - truth).head<4>().array() / estimate.sd.head<4>().array())
               .square()
               .sum();
  }
  // As above; 12 numbers: chi2 / 12 lies below 2.5 (99.9 % each).
  EXPECT_LT(sum / (4 * kTrials), 1.8);
  EXPECT_LT(of_edges / kTrials, 2.5);
}

// A sheet of paper in the hand bends otherwise in each view: a corner's own scatter shows nothing of that.
TEST(Intrinsics, WhatCornersOfAViewShareIsInTheDeviations) {
  const Target target = parse_target("chessboard:9x6:0.025");
  const IntrinsicsVector truth = to_vector(lens());
  double sum = 0, of_corners = 0;
  constexpr unsigned kTrials = 12;
  for (unsigned seed = 0; seed < kTrials; ++seed) {
    std::mt19937 random(seed);
    std::normal_distribution<double> bend(0, 5e-4);
    std::vector<Observation> list;
    for (int v = 0; v < 24; ++v) {
      const Warp warp(bend(random), bend(random), bend(random));
      list.push_back(views(target, 1, 0.7, 0.05, 1000 * seed + v, warp).front());
    }
    const IntrinsicsEstimate estimate = calibrate_intrinsics(target, list, 640, 480);
    EXPECT_GT(estimate.view_factor, 2);
    const double squares =
        ((to_vector(estimate.camera) - truth).head<4>().array() / estimate.sd.head<4>().array())
            .square()
            .sum();
    sum += squares;
    of_corners += squares * estimate.view_factor;
  }
  // As of StandardDeviationsAreTrue; by the corners alone far beyond.
  EXPECT_GT(sum / (4 * kTrials), 0.4);
  EXPECT_LT(sum / (4 * kTrials), 1.8);
  EXPECT_GT(of_corners / (4 * kTrials), 3);
}

TEST(Intrinsics, WhatPicturesDoNotDetermineIsSaid) {
  const Target target = parse_target("chessboard:9x6:0.025");
  const IntrinsicsEstimate flat = calibrate_intrinsics(target, views(target, 10, 0.05, 0.1, 1), 640, 480);
  ASSERT_FALSE(flat.warnings.empty());
  EXPECT_NE(flat.warnings.front().find("never tilted"), std::string::npos);
  EXPECT_FALSE(flat.usable());
  std::vector<Observation> few = views(target, 2, 0.5, 0.1, 1);
  EXPECT_NE(data::input_error_of([&] { calibrate_intrinsics(target, few, 640, 480); }).find("found 2"),
            std::string::npos);
}

TEST(Intrinsics, CopiesOfAPictureTellNothingMore) {
  const Target target = parse_target("chessboard:9x6:0.025");
  std::vector<Observation> list = views(target, 10, 0.7, 0.1, 2);
  const IntrinsicsEstimate once = calibrate_intrinsics(target, list, 640, 480);
  EXPECT_TRUE(once.usable());
  list.insert(list.end(), list.begin(), list.begin() + 5);
  const IntrinsicsEstimate twice = calibrate_intrinsics(target, list, 640, 480);
  // But for rounding: threads share the sums otherwise.
  EXPECT_LE((twice.sd - once.sd).norm(), 1e-9 * once.sd.norm());
  EXPECT_EQ(twice.views[12].reason, "a copy of 2");
}

TEST(Intrinsics, AViewWithWrongCornersIsLeftOut) {
  const Target target = parse_target("chessboard:9x6:0.025");
  std::vector<Observation> list = views(target, 10, 0.7, 0.1, 2);
  // Half of the board numbered one column off.
  list[3].pixels.leftCols(27) = list[3].pixels.middleCols(1, 27).eval();
  const IntrinsicsEstimate estimate = calibrate_intrinsics(target, list, 640, 480);
  EXPECT_FALSE(estimate.views[3].reason.empty());
  EXPECT_NEAR(estimate.rms, 0.1 * std::sqrt(2.0), 0.02);
}

}  // namespace
}  // namespace flash::calib
