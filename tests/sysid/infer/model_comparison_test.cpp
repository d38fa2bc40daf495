#include "sysid/infer/model_comparison.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <random>

#include "tests/sysid/infer/strip_rows.h"

namespace flash::sysid {
namespace {

/// By what two models differ, of unit root mean square.
Eigen::VectorXd difference(const ObservedRows& rows) {
  const Eigen::VectorXd wave = Eigen::VectorXd::NullaryExpr(rows.weights.size(), [&](Eigen::Index i) {
    const double t = rows.times[static_cast<std::size_t>(rows.keyframe[static_cast<std::size_t>(i)])] / 0.8;
    return std::sin(M_PI * rows.places(i, 0) / 0.2) * t;
  });
  return wave / std::sqrt(wave.squaredNorm() / static_cast<double>(wave.size()));
}

double excess(const ObservedRows& rows, const Eigen::VectorXd& reference, const Eigen::VectorXd& other) {
  return excess_deviance({{rows, reference}}, {{rows, other}});
}

TEST(ModelComparison, WithoutADiscrepancyTheExcessIsThatOfTheNoise) {
  const ObservedRows rows = strip_rows(9, 40);
  const Eigen::VectorXd apart = 0.5 * kNoise * difference(rows);
  const double expected = apart.squaredNorm() / (kNoise * kNoise);  // 90
  std::mt19937 random(1);
  double mean = 0;
  constexpr int kDraws = 40;
  for (int draw = 0; draw < kDraws; ++draw) {
    const Eigen::VectorXd y = kNoise * normal(random, rows.weights.size());
    mean += excess(rows, y, y + apart) / kDraws;
    EXPECT_EQ(excess(rows, y, y), 0);
  }
  // Huber's function takes 5 %; a discrepancy that is never quite ruled out takes more, never all.
  EXPECT_LT(mean, expected);
  EXPECT_GT(mean, 0.3 * expected);
}

// A discrepancy ten times the noise hides what the noise alone would tell.
TEST(ModelComparison, WhatADiscrepancyMakesIsNotTold) {
  const ObservedRows rows = strip_rows(9, 40);
  const Eigen::Index count = rows.weights.size();
  std::mt19937 random(2);
  const DiscrepancyModel any(rows, kNoise * normal(random, count));
  const std::size_t shape = 10;
  const Eigen::MatrixXd root =
      Eigen::MatrixXd(any.covariance(shape) + 1e-9 * Eigen::MatrixXd::Identity(count, count)).llt().matrixL();
  const Eigen::VectorXd apart = kNoise * difference(rows);
  constexpr int kDraws = 60;
  int wrong = 0, told = 0;
  for (int draw = 0; draw < kDraws; ++draw) {
    const Eigen::VectorXd y = kNoise * normal(random, count) + 10 * kNoise * (root * normal(random, count));
    // The truth's residuals are y; the other model's are farther off or, as the discrepancy falls, nearer.
    const Eigen::VectorXd other = y + apart;
    const bool truth_is_nearer = y.cwiseAbs().mean() < other.cwiseAbs().mean();
    const double over = truth_is_nearer ? excess(rows, y, other) : excess(rows, other, y);
    told += over > 4;
    wrong += !truth_is_nearer && over > 4;
  }
  EXPECT_LE(wrong, 6);  // 5 % at two standard deviations; 3 expected of 60, 1.8 sd
  EXPECT_LT(told, kDraws / 2);
}

TEST(ModelComparison, ErrorsThatWereFittedCost) {
  const ObservedRows rows = strip_rows(5, 20);
  std::mt19937 random(3);
  const Eigen::VectorXd y = kNoise * normal(random, rows.weights.size());
  EXPECT_NEAR(excess_deviance({{rows, y, 1}}, {{rows, y, 4}}), 3, 1e-12);
}

TEST(ModelComparison, RecordingsAddUp) {
  const ObservedRows rows = strip_rows(5, 20);
  std::mt19937 random(4);
  const Eigen::VectorXd first = kNoise * normal(random, 100), second = kNoise * normal(random, 100),
                        apart = kNoise * difference(rows);
  EXPECT_NEAR(
      excess_deviance({{rows, first}, {rows, second}}, {{rows, first + apart}, {rows, second + apart}}),
      excess(rows, first, first + apart) + excess(rows, second, second + apart), 1e-9);
}

TEST(ModelComparison, OccupiedShareIsThatOfTheLinearModel) {
  // One direction told to 1 % of its prior's deviation, one not at all.
  const double spread = 2e-3;
  const Eigen::Vector2d information(std::pow(spread / 0.01, 2), 0);
  EXPECT_NEAR(log_occupied(information, spread), std::log(0.01), 1e-4);
  EXPECT_EQ(log_occupied({}, spread), 0);
}

TEST(ModelComparison, PriorsAreThoseOfTheRanges) {
  std::vector<Axis> axes = {
      {"bending", {1e-5, 1e-4, 1e-3}, true}, {"poisson", {0.3}, false}, {"table_height", {-1, 2}, false}};
  const std::vector<double> spreads = spreads_over(axes, {{1e-4, 2e-4}, {0.3, 0.3}, {0, 1.5}});
  ASSERT_EQ(spreads.size(), 2u);
  EXPECT_NEAR(spreads[0], std::log(100) / std::log(2) / std::sqrt(12), 1e-12);
  EXPECT_NEAR(spreads[1], 2 / std::sqrt(12), 1e-12);
}

}  // namespace
}  // namespace flash::sysid
