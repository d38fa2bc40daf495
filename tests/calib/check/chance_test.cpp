#include "calib/check/chance.h"

#include <gtest/gtest.h>

#include <cmath>

namespace flash::calib {
namespace {

TEST(Chance, IsThatOfChiSquare) {
  EXPECT_EQ(chance_beyond(0, 6), 1);
  EXPECT_NEAR(chance_beyond(5.991, 2), 0.05, 2e-5);  // tables, of three decimals
  EXPECT_NEAR(chance_beyond(3.841, 1), 0.05, 2e-5);
  EXPECT_NEAR(chance_beyond(7.815, 3), 0.05, 2e-5);
  EXPECT_NEAR(chance_beyond(12.592, 6), 0.05, 2e-5);
  EXPECT_NEAR(chance_beyond(124.342, 100), 0.05, 2e-5);
  // Of many degrees of freedom it is nearly normal (Wilson and Hilferty 1931).
  EXPECT_NEAR(chance_beyond(4000, 4000), 0.5, 0.01);
  EXPECT_NEAR(chance_beyond(4000 + 1.645 * std::sqrt(8000), 4000), 0.05, 0.002);
}

TEST(Chance, SmallOnesAreNotZero) {
  EXPECT_EQ(chance_text(0.0125), "1.25 %");
  EXPECT_EQ(chance_text(0), "less than 0.0001 %");
}

}  // namespace
}  // namespace flash::calib
