#include "sysid/capture/lying_sheet.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

namespace flash::sysid {
namespace {

std::vector<Eigen::Vector2d> points_on(const LyingSheet& sheet) {
  const Eigen::Rotation2Dd turn(sheet.heading - std::atan2(sheet.left, sheet.right));
  std::vector<Eigen::Vector2d> points;
  for (double u = 0; u <= sheet.right; u += 0.01)
    for (double v = 0; v <= sheet.left; v += 0.01)
      points.emplace_back(sheet.corner + turn * Eigen::Vector2d(u, v));
  return points;
}

TEST(LyingSheet, FindsItsTurnAndTellsItsSidesApart) {
  const LyingSheet truth{{0.5, 0.1}, 0.3, 0.24, 2.0};
  const std::vector<Eigen::Vector2d> points = points_on(truth);
  LyingSheet guess = truth;
  guess.heading += 10 * std::numbers::pi / 180;
  EXPECT_NEAR(turned_to(guess, points).heading, truth.heading, 1e-9);  // steps are of one degree
  // Samples of the sheet are half a diagonal of the points' raster from them at most.
  EXPECT_LT(distance_to(truth, points), 0.5 * std::numbers::sqrt2 * 0.01);
  LyingSheet swapped{truth.corner, truth.left, truth.right, truth.heading};
  swapped = turned_to(swapped, points);
  EXPECT_GT(distance_to(swapped, points), 2 * distance_to(truth, points));
  EXPECT_TRUE(std::isinf(distance_to(truth, {})));
}

}  // namespace
}  // namespace flash::sysid
