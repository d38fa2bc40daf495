#include "calib/detect/board_depth.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "data/files/error.h"
#include "tests/calib/hand_eye_scene.h"

namespace flash::calib {
namespace {

constexpr double kScale = 1e-5;  // [m] a count: rounding is no part of the noise

/// A board as a depth camera sees it, pixel by pixel.
struct DepthScene {
  HandEyeScene scene = make_scene(protocol_settings(Setup::eye_in_hand), board_points(), 1);
  const Observation& view = scene.observations.front();
  Eigen::Isometry3d truth = scene.truth.X.inverse() * scene.true_poses.front().inverse() * scene.truth.Z;
  std::mt19937 random{1};

  double plane(double x, double y) const {
    const Eigen::Vector3d ray = data::unproject(scene.camera, {x, y}, 1), normal = truth.linear().col(2);
    return normal.dot(truth.translation()) / normal.dot(ray);
  }
  data::DepthImage draw(double noise) {
    std::normal_distribution<double> error(0, noise);
    data::DepthImage depth;
    depth.width = scene.camera.width;
    depth.height = scene.camera.height;
    for (int y = 0; y < depth.height; ++y)
      for (int x = 0; x < depth.width; ++x)
        depth.pixels.push_back(
            static_cast<std::uint16_t>(std::lround((plane(x, y) + error(random)) / kScale)));
    return depth;
  }
  /// Measured minus true at the three places, along the ray.
  Eigen::Vector3d errors(const BoardDepth& depth) const {
    Eigen::Vector3d result;
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d& P = depth.points.col(k);
      const Eigen::Vector3d normal = truth.linear().col(2);
      result[k] = P.z() - P.z() * normal.dot(truth.translation()) / normal.dot(P);
    }
    return result;
  }
};

TEST(BoardDepth, ThreePlacesAreIndependentAndCarryWhatAllPixelsKnow) {
  DepthScene scene;
  constexpr int kTrials = 60;
  constexpr double kNoise = 2e-3;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  int pixels = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    const BoardDepth depth =
        board_depth(data::in_metres(scene.draw(kNoise), kScale), scene.scene.camera, scene.view);
    ASSERT_EQ(depth.points.cols(), 3);
    pixels = depth.pixels;
    // Pixels beyond four sigma, 1 in 16,000, are left out.
    EXPECT_NEAR(depth.noise, kNoise, 5 * kNoise / std::sqrt(2.0 * pixels));
    const Eigen::Vector3d error = scene.errors(depth);
    covariance += error * error.transpose() / kTrials;
  }
  // Three unknowns from n pixels, spread over three numbers: variance 3 sigma^2 / n each, were the board
  // seen from the front; aslant its nearer parts weigh less. A variance of 60 samples is known to 18 %.
  const double expected = 3 * kNoise * kNoise / pixels;
  EXPECT_NEAR(covariance.trace() / 3, expected, 0.35 * expected);
  for (int k = 0; k < 3; ++k) {
    const int next = (k + 1) % 3;
    const double correlation = covariance(k, next) / std::sqrt(covariance(k, k) * covariance(next, next));
    EXPECT_LT(std::abs(correlation), 3.3 / std::sqrt(kTrials));  // 99.9 %
  }
}

TEST(BoardDepth, FlyingPixelsAndHolesAreLeftOut) {
  DepthScene scene;
  data::DepthImage depth = scene.draw(1e-3);
  std::uniform_real_distribution<double> uniform(0, 1);
  for (std::uint16_t& count : depth.pixels) {
    const double u = uniform(scene.random);
    if (u < 0.2) count = 0;
    if (u > 0.9) count = static_cast<std::uint16_t>(1.3 * count);
  }
  const BoardDepth board = board_depth(data::in_metres(depth, kScale), scene.scene.camera, scene.view);
  ASSERT_EQ(board.points.cols(), 3);
  EXPECT_NEAR(board.noise, 1e-3, 5e-5);
  EXPECT_LT(scene.errors(board).cwiseAbs().maxCoeff(), 5 * 1e-3 * std::sqrt(3.0 / board.pixels));
}

TEST(BoardDepth, PlacesLieWithinTheOutline) {
  DepthScene scene;
  const BoardDepth board =
      board_depth(data::in_metres(scene.draw(0), kScale), scene.scene.camera, scene.view);
  const Eigen::Vector3d low = scene.scene.points.rowwise().minCoeff(),
                        high = scene.scene.points.rowwise().maxCoeff();
  for (int k = 0; k < 3; ++k) {
    const Eigen::Vector3d place = scene.truth.inverse() * Eigen::Vector3d(board.points.col(k));
    EXPECT_NEAR(place.z(), 0, kScale);
    EXPECT_GT((place - low).head<2>().minCoeff(), 0);
    EXPECT_GT((high - place).head<2>().minCoeff(), 0);
  }
  EXPECT_NEAR(depth_over_pose(board.points, scene.truth), 1, 1e-5);
  Eigen::Isometry3d nearer = scene.truth;
  nearer.translation() *= 0.5;
  EXPECT_NEAR(depth_over_pose(board.points, nearer), 2, 2e-5);
}

TEST(BoardDepth, UnregisteredDepthIsRefusedAndNoDepthIsNone) {
  DepthScene scene;
  data::DepthImage depth;
  depth.width = 4;
  depth.height = 3;
  depth.pixels.assign(12, 500);
  EXPECT_THROW(board_depth(data::in_metres(depth, kScale), scene.scene.camera, scene.view), data::InputError);
  depth = scene.draw(0);
  std::fill(depth.pixels.begin(), depth.pixels.end(), std::uint16_t{0});
  EXPECT_EQ(board_depth(data::in_metres(depth, kScale), scene.scene.camera, scene.view).points.cols(), 0);
}

TEST(PixelsWithin, AreThoseOfTheHull) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(-3, 23);
  for (int trial = 0; trial < 20; ++trial) {
    // A triangle, by brute force on the signs of its sides.
    Eigen::Matrix2Xd corners = Eigen::Matrix2Xd::NullaryExpr(2, 3, [&] { return uniform(random); });
    std::vector<Eigen::Vector2i> expected;
    const auto side = [&](int i, double x, double y) {
      const Eigen::Vector2d a = corners.col(i), b = corners.col((i + 1) % 3);
      return (b.x() - a.x()) * (y - a.y()) - (b.y() - a.y()) * (x - a.x());
    };
    for (int y = 0; y < 18; ++y)
      for (int x = 0; x < 20; ++x)
        if ((side(0, x, y) >= 0) == (side(1, x, y) >= 0) && (side(1, x, y) >= 0) == (side(2, x, y) >= 0))
          expected.emplace_back(x, y);
    EXPECT_EQ(pixels_within(corners, 20, 18), expected) << trial;
  }
}

}  // namespace
}  // namespace flash::calib
