#include "sim/scene/grasp.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

namespace flash::sim {
namespace {

TEST(Pinch, FoldsThePatchAboutItsRidgeWithoutStretchingIt) {
  data::Points flat(5, 3);
  flat << 0, 0, 0, 0.02, 0, 0, 0, 0.02, 0, 0.02, 0.02, 0, 0.01, 0.01, 0;
  const Eigen::Vector3d ridge = Eigen::Vector3d(1, 1, 0).normalized();
  const data::Points folded = pinch_targets(flat, ridge, Eigen::Vector3d::UnitZ(), 0);
  const double half = 0.02 / std::sqrt(2.0);
  // Both wings come down from the ridge and stand on the table together.
  EXPECT_NEAR(folded(0, 2), half, 1e-15);
  EXPECT_NEAR(folded(3, 2), half, 1e-15);
  EXPECT_NEAR(folded(1, 2), 0, 1e-15);
  EXPECT_NEAR((folded.row(1) - folded.row(2)).norm(), 0, 1e-15);
  for (const auto& [i, j] : {std::pair{0, 1}, {0, 2}, {1, 3}, {0, 4}, {3, 4}}) {
    EXPECT_NEAR((folded.row(i) - folded.row(j)).norm(), (flat.row(i) - flat.row(j)).norm(), 1e-15);
  }
  const data::Points tilted = pinch_targets(flat, ridge, Eigen::Vector3d::UnitZ(), 0.5);
  EXPECT_NEAR((tilted.row(0) - tilted.row(3)).norm(), (flat.row(0) - flat.row(3)).norm(), 1e-15);
  EXPECT_NEAR((tilted(0, 2) - tilted(3, 2)) / (tilted.row(0) - tilted.row(3)).norm(), std::sin(0.5), 1e-12);
}

TEST(Pinch, SidesOfTheFoldAreAThicknessApartAndAsLongAsTheyWere) {
  constexpr double apart = 1e-3, half = 0.02;
  data::Points flat(5, 3);
  flat << 0, -half, 0, 0, -0.5 * half, 0, 0, 0, 0, 0, 0.5 * half, 0, 0, half, 0;
  const data::Points folded =
      pinch_targets(flat, Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitZ(), 0, apart);
  EXPECT_NEAR((folded.row(0) - folded.row(4)).norm(), apart, 1e-15);
  EXPECT_NEAR((folded.row(1) - folded.row(3)).norm(), apart, 1e-15);
  EXPECT_NEAR((folded.row(0) - folded.row(1)).norm(), 0.5 * half, 1e-15);
  // From the ridge half of the way goes aside, and the rest down.
  EXPECT_NEAR(folded(2, 2) - folded(3, 2), 0.5 * half - 0.5 * apart, 1e-15);
  EXPECT_NEAR(std::abs(folded(3, 1) - folded(2, 1)), 0.5 * apart, 1e-15);
}

}  // namespace
}  // namespace flash::sim
