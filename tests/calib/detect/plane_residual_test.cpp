#include "calib/detect/plane_residual.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "calib/dataset/target.h"
#include "tests/calib/rendered_view.h"

namespace flash::calib {
namespace {

TEST(PlaneResidual, IsTheNoiseOfCornersOfAFlatTarget) {
  const Target target = parse_target("chessboard:11x8:0.02");
  const Eigen::Matrix3Xd points = target_points(target);
  const data::CameraIntrinsics camera = small_camera();
  std::mt19937 random(3);
  constexpr double kNoise = 0.3;  // an axis [px]
  std::normal_distribution<double> noise(0, kNoise);
  double squares = 0;
  constexpr int kViews = 20;
  for (int view = 0; view < kViews; ++view) {
    const Eigen::Isometry3d pose = random_view(target, camera, 0.4, 0.6, 0.6, random);
    Observation observation;
    observation.pixels.resize(2, points.cols());
    for (Eigen::Index i = 0; i < points.cols(); ++i) {
      observation.points.push_back(static_cast<int>(i));
      observation.pixels.col(i) =
          *data::project(camera, pose * points.col(i)) + Eigen::Vector2d(noise(random), noise(random));
    }
    squares += std::pow(plane_residual(points, observation), 2) / kViews;
  }
  // 20 x 168 degrees of freedom: the rms scatters by 1.2 %; four of these.
  EXPECT_NEAR(std::sqrt(squares) / (std::sqrt(2) * kNoise), 1, 0.05);
}

TEST(PlaneResidual, FourCornersTellNothing) {
  Observation observation;
  observation.points = {0, 1, 2, 3};
  observation.pixels.resize(2, 4);
  observation.pixels << 0, 10, 10, 0, 0, 0, 10, 11;
  EXPECT_EQ(plane_residual(target_points(parse_target("aruco:DICT_4X4_50:0:0.09")), observation), 0);
}

}  // namespace
}  // namespace flash::calib
