#include "sysid/infer/scrambled_halton.h"

#include <gtest/gtest.h>

#include <cmath>

namespace flash::sysid {
namespace {

TEST(ScrambledHalton, EachPartOfACoordinateHasItsPoints) {
  // In a prime base b, b^n points in a row have one in each of b^n equal parts, however digits are permuted.
  const Eigen::MatrixXd points = scrambled_halton(625, 3, 7);
  EXPECT_GE(points.minCoeff(), 0);
  EXPECT_LT(points.maxCoeff(), 1);
  const int parts[] = {512, 243, 625};
  for (int k = 0; k < 3; ++k) {
    Eigen::VectorXi counts = Eigen::VectorXi::Zero(parts[k]);
    for (int i = 0; i < parts[k]; ++i) ++counts[static_cast<int>(std::floor(points(i, k) * parts[k]))];
    EXPECT_EQ(counts.minCoeff(), 1) << k;
  }
}

TEST(ScrambledHalton, MeansOfProductsAreNearerThanThoseOfIndependentPoints) {
  constexpr Eigen::Index kCount = 2048, kDimensions = 6;
  const double exact = std::pow(0.5, kDimensions);
  // Of independent points, the mean of the product of all coordinates has this standard deviation.
  const double independent =
      std::sqrt((std::pow(1.0 / 3, kDimensions) - exact * exact) / static_cast<double>(kCount));
  double squares = 0;
  constexpr int kSeeds = 20;
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    const double mean = scrambled_halton(kCount, kDimensions, seed).rowwise().prod().mean();
    squares += std::pow(mean - exact, 2) / kSeeds;
  }
  EXPECT_LT(std::sqrt(squares), 0.5 * independent);
}

TEST(ScrambledHalton, MorePointsBeginWithTheSameAndSeedsDiffer) {
  const Eigen::MatrixXd few = scrambled_halton(10, 4, 3), more = scrambled_halton(100, 4, 3);
  EXPECT_EQ(few, more.topRows(10));
  EXPECT_NE(few, scrambled_halton(10, 4, 4));
}

}  // namespace
}  // namespace flash::sysid
