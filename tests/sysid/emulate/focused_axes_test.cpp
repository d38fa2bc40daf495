#include "sysid/emulate/focused_axes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

namespace flash::sysid {
namespace {

/// 0, 1, ..., count - 1.
Axis counted(const char* name, std::size_t count) {
  Axis axis{name, std::vector<double>(count), false};
  std::iota(axis.values.begin(), axis.values.end(), 0.0);
  return axis;
}

TEST(FocusedAxes, OfASmallGridAreAllOfIt) {
  const std::vector<Axis> axes = {counted("young", 25), counted("bending", 24)};
  EXPECT_EQ(focused(axes, {3, 7})[0].values, axes[0].values);
  EXPECT_EQ(most_focused(axes)[1].values, axes[1].values);
}

TEST(FocusedAxes, OfALargeOneAreDenseAboutItsBest) {
  const std::vector<Axis> axes = {counted("young", 64), counted("bending", 64), counted("poisson", 1)};
  const std::vector<Axis> kept = focused(axes, {20, 63, 0});
  EXPECT_EQ(kept[0].values, std::vector<double>({0, 4, 12, 16, 18, 19, 20, 21, 22, 24, 28, 36, 52, 63}));
  EXPECT_EQ(kept[1].values, std::vector<double>({0, 31, 47, 55, 59, 61, 62, 63}));
  EXPECT_EQ(kept[2].values, std::vector<double>({0}));
}

TEST(FocusedAxes, HaveABoundThatHoldsForEveryBest) {
  const std::vector<Axis> axes = {counted("young", 40), counted("bending", 29)};
  const std::vector<Axis> most = most_focused(axes);
  std::size_t largest = 0;
  for (const double best : axes[0].values)
    largest = std::max(largest, focused(axes, {best, 0})[0].values.size());
  EXPECT_EQ(most[0].values.size(), largest);
  EXPECT_LT(count_candidates(most), 200);  // 2 log2(40) + 3 times 2 log2(29) + 3 at most
}

}  // namespace
}  // namespace flash::sysid
