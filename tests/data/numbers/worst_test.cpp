#include "data/numbers/worst.h"

#include <gtest/gtest.h>

#include <cmath>

namespace flash::data {
namespace {

TEST(Worst, IsNeverLostForNotBeingANumber) {
  EXPECT_EQ(worst(1, 2), 2);
  EXPECT_EQ(worst(2, 1), 2);
  EXPECT_TRUE(std::isinf(worst(1, NAN)));
  EXPECT_TRUE(std::isinf(worst(NAN, 1)));
}

}  // namespace
}  // namespace flash::data
