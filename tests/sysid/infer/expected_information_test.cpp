#include "sysid/infer/expected_information.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>

namespace flash::sysid {
namespace {

/// Keyframes of points over a sheet.
ObservedRows rows_over(int keyframes, int points, int parameters, unsigned seed) {
  std::srand(seed);
  ObservedRows rows;
  const Eigen::Index count = static_cast<Eigen::Index>(keyframes) * points;
  rows.places = 0.1 * (Eigen::MatrixX2d::Random(count, 2).array() + 1);
  rows.weights = Eigen::VectorXd::Ones(count);
  rows.rates = Eigen::MatrixXd::Random(count, parameters);
  for (int k = 0; k < keyframes; ++k) {
    rows.times.push_back(0.1 * k);
    rows.keyframe.insert(rows.keyframe.end(), static_cast<std::size_t>(points), k);
    rows.channel.insert(rows.channel.end(), static_cast<std::size_t>(points), 0);
  }
  return rows;
}

// Fisher's information of normal rows.
TEST(ExpectedInformation, OfNoiseAloneIsThatOfLeastSquares) {
  ObservedRows rows = rows_over(5, 40, 3, 1);
  rows.weights.tail(50).setConstant(0.25);
  Misfit misfit;
  misfit.noise = misfit.rough = 2e-3;
  const Eigen::MatrixXd expected =
      rows.rates.transpose() * rows.weights.asDiagonal() * rows.rates / (2e-3 * 2e-3);
  EXPECT_LT((expected_information(rows, misfit) - expected).norm(), 1e-9 * expected.norm());
}

// An error that no bound holds back takes all that looks like it with it: the information is that of what is
// left of the rates, by the normal equations of both.
TEST(ExpectedInformation, WhatIsFittedBesideTheParametersIsTakenOut) {
  ObservedRows rows = rows_over(4, 30, 2, 2);
  Misfit misfit;
  misfit.noise = misfit.rough = 1e-3;
  rows.known = 0.01 * Eigen::MatrixXd::Random(120, 1);
  rows.free = 0.02 * Eigen::MatrixXd::Random(120, 2);
  Eigen::MatrixXd all(120, 5);
  all << rows.rates, rows.known, rows.free;
  Eigen::MatrixXd normal = all.transpose() * all / 1e-6;
  normal(2, 2) += 1;                                   // unit variance
  normal.diagonal().tail(2).array() += 1 / (1.0 / 3);  // even between -1 and 1
  const Eigen::MatrixXd covariance = normal.inverse().topLeftCorner(2, 2);
  EXPECT_LT((expected_information(rows, misfit) - covariance.inverse()).norm(),
            1e-6 * covariance.inverse().norm());
}

// A discrepancy that is the same everywhere and always: of a mean of n rows its variance stays, however many
// there are. The reaches are finite, a thousand times what is observed.
TEST(ExpectedInformation, ADiscrepancyThatNeverChangesIsNotAveragedAway) {
  for (const int points : {10, 1000}) {
    ObservedRows rows = rows_over(6, points, 1, 3);
    rows.rates.setConstant(0.5);
    Misfit misfit;
    misfit.noise = misfit.rough = 1e-3;
    misfit.rms = 4e-3;
    misfit.reach_time = 500;
    misfit.reach_sheet = 200;
    const double variance = (1e-6 / (6 * points) + 16e-6) / 0.25;
    EXPECT_NEAR(expected_information(rows, misfit)(0, 0), 1 / variance, 1e-3 / variance);
  }
}

// Discrepancies of keyframes that have nothing in common average out as keyframes, not as points.
TEST(ExpectedInformation, KeyframesFarApartInTimeCountOneByOne) {
  ObservedRows rows = rows_over(6, 300, 1, 4);
  rows.rates.setConstant(1);
  Misfit misfit;
  misfit.noise = misfit.rough = 1e-6;
  misfit.rms = 4e-3;
  misfit.reach_time = 1e-3;
  misfit.reach_sheet = 200;
  const double variance = 16e-6 / 6;
  EXPECT_NEAR(expected_information(rows, misfit)(0, 0), 1 / variance, 1e-3 / variance);
}

TEST(ExpectedInformation, OfWhatDoesNotMoveIsNone) {
  ObservedRows rows = rows_over(2, 10, 2, 5);
  rows.rates.setZero();
  Misfit misfit;
  misfit.noise = misfit.rough = 1e-3;
  EXPECT_EQ(expected_information(rows, misfit), Eigen::MatrixXd::Zero(2, 2));
}

}  // namespace
}  // namespace flash::sysid
