#include "sim/newton/accepted.h"

#include <gtest/gtest.h>

#include <cmath>

namespace flash::sim {
namespace {

TEST(Accepted, FewStepsMayMissTheToleranceAndNoneTheWeight) {
  EXPECT_TRUE(accepted(0, 1e-3));
  EXPECT_TRUE(accepted(0.01, 0.5));
  EXPECT_FALSE(accepted(0.02, 0.5));
  EXPECT_FALSE(accepted(0.001, 270));
  EXPECT_FALSE(accepted(0.001, INFINITY));
  EXPECT_FALSE(accepted(0.001, NAN));
}

}  // namespace
}  // namespace flash::sim
