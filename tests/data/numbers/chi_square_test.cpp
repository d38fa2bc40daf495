#include "data/numbers/chi_square.h"

#include <gtest/gtest.h>

#include <cmath>

namespace flash::data {
namespace {

// The chance to be above x, in closed form: of an odd number of degrees of freedom by erfc, of an even one by
// the exponential series.
TEST(ChiSquare, PointsHaveTheirChance) {
  const auto beyond_of_1 = [](double x) { return std::erfc(std::sqrt(x / 2)); };
  const auto beyond_of_3 = [&](double x) {
    return beyond_of_1(x) + std::sqrt(2 * x / M_PI) * std::exp(-x / 2);
  };
  const auto beyond_of_6 = [](double x) { return std::exp(-x / 2) * (1 + x / 2 + x * x / 8); };
  constexpr double kDigits = 1e-6;  // of the points, whose density is below 1
  EXPECT_NEAR(beyond_of_1(chi_square_95_of_1), 0.05, kDigits);
  EXPECT_NEAR(beyond_of_3(chi_square_95_of_3), 0.05, kDigits);
  EXPECT_NEAR(beyond_of_6(chi_square_50_of_6), 0.5, kDigits);
  EXPECT_NEAR(beyond_of_6(chi_square_95_of_6), 0.05, kDigits);
  EXPECT_NEAR(beyond_of_6(chi_square_9875_of_6), 0.0125, kDigits);
  EXPECT_NEAR(beyond_of_6(chi_square_99_of_6), 0.01, kDigits);
}

}  // namespace
}  // namespace flash::data
