#include "sim/newton/line_search.h"

#include <gtest/gtest.h>

#include <cmath>
#include <utility>
#include <vector>

namespace flash::sim {
namespace {

/// A line that is told what its points have.
struct Told {
  double potential = 5, residual = 3;
  double (*falls_to)(double) = [](double) { return 6.0; };
  double later_residual = 3, slope = 0;
  double trial = 6, second = 6;
  std::vector<double> lengths = {};
  int taken = 0;

  double start_potential() const { return potential; }
  double start_residual() const { return residual; }
  double trial_potential() const { return trial; }
  double trial_residual() const { return later_residual; }
  double second_potential() const { return second; }
  double second_residual() const { return later_residual; }
  double end_slope() const { return slope; }
  double move(double length) {
    lengths.push_back(length);
    trial = falls_to(length);
    return length;
  }
  double move_second(double length) {
    lengths.push_back(length);
    second = falls_to(length);
    return length;
  }
  void take_second() {
    ++taken;
    std::swap(trial, second);
  }
};

constexpr double slope = -2;

bool accepts(double potential, double residual, bool coupled = false) {
  return acceptable(Told{.later_residual = residual, .trial = potential}, coupled, slope, 0.5);
}

// Armijo's rule: a ten-thousandth of what the slope promises.
TEST(LineSearch, APointIsTakenWhereThePotentialFalls) {
  const double falls = 1e-4 * 0.5 * 2;
  EXPECT_TRUE(accepts(5 - 1.01 * falls, 3));
  EXPECT_FALSE(accepts(5 - 0.99 * falls, 3));
  EXPECT_FALSE(accepts(std::nan(""), std::nan("")));
}

// By a tenth of what a whole step promises, which is all of the residual.
TEST(LineSearch, APointIsTakenWhereTheResidualFalls) {
  EXPECT_TRUE(accepts(6, 0.949 * 3));
  EXPECT_FALSE(accepts(6, 0.951 * 3));
  EXPECT_FALSE(accepts(4, 3, true));
  EXPECT_TRUE(accepts(6, 0.949 * 3, true));
}

// Of a line that rises the end is the first power of a half below a thousandth.
TEST(LineSearch, AStepIsHalvedDownToAThousandth) {
  Told rises;
  EXPECT_EQ(shorten(rises, false, slope), 1.0 / 1024);
  EXPECT_EQ(rises.lengths.size(), 11U);
  Told falls{.falls_to = [](double length) { return length > 0.2 ? 6.0 : 4.0; }};
  EXPECT_EQ(shorten(falls, false, slope), 0.125);
  EXPECT_EQ(falls.lengths, (std::vector{1.0, 0.5, 0.25, 0.125}));
}

TEST(LineSearch, ASecantGrowsByHalfToThreefold) {
  EXPECT_DOUBLE_EQ(growth_of(-2, -1), 2);  // a parabola's lowest point
  EXPECT_DOUBLE_EQ(growth_of(-2, -0.4), 1.5);
  EXPECT_DOUBLE_EQ(growth_of(-2, -1.6), 3);
}

/// Where a line is lengthened to whose slope is always `end`, whose potential falls, and whose residual is
/// `residual` after the first step.
double lengthened(double end, double residual, int* taken = nullptr) {
  Told line{.falls_to = [](double length) { return -length; },
            .later_residual = residual,
            .slope = end,
            .trial = 4};
  const double length = lengthen(line, slope, 1);
  if (taken != nullptr) *taken = line.taken;
  return length;
}

TEST(LineSearch, AStepIsLengthenedWhileThePotentialFalls) {
  int taken = 0;
  EXPECT_EQ(lengthened(-1, 3, &taken), 32);  // by twos, beyond thirty
  EXPECT_EQ(taken, 5);
  EXPECT_EQ(lengthened(-0.41, 3), std::pow(1.5, 9));  // steeper than a fifth
  EXPECT_EQ(lengthened(-0.39, 3), 1);
  EXPECT_EQ(lengthened(-1, 29), 32);  // a residual below ten times the first
  EXPECT_EQ(lengthened(-1, 31), 1);
  EXPECT_EQ(lengthened(-1, std::nan("")), 1);
  Told rises{.slope = -1, .trial = 4};
  EXPECT_EQ(lengthen(rises, slope, 1), 1);
}

}  // namespace
}  // namespace flash::sim
