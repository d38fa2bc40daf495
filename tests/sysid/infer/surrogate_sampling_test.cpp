#include "sysid/infer/surrogate_sampling.h"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

#include "tests/sysid/infer/ridge.h"

namespace flash::sysid {
namespace {

/// Weight of the draws below quantiles, against the exact share: four standard deviations of as many
/// independent draws as are stated, and what a surrogate that just agrees may be off by. That is its
/// deviation, sqrt(1 / 0.95 - 1), over the half of the mass that lies on a side at most: 0.23 / 2 of the
/// deviation of a share, sqrt(share (1 - share)), by Cauchy and Schwarz.
void expect_ridge(const WeightedDraws& draws, const Ridge& ridge) {
  const double off = std::sqrt(1 / SurrogateSettings().agreement - 1);
  for (Eigen::Index k = 0; k < ridge.dimensions(); ++k)
    for (const double share : {0.025, 0.25, 0.5, 0.75, 0.975}) {
      const double x = ridge.quantile(k, share);
      const double below = (draws.points.col(k).array() < x).cast<double>().matrix().dot(draws.weights);
      EXPECT_NEAR(below, share,
                  std::sqrt(share * (1 - share)) * (4 / std::sqrt(draws.effective_size) + off / 2))
          << "coordinate " << k << ", " << share;
    }
}

TEST(SurrogateSampling, RidgesHaveTheirQuantilesByFarFewerPoints) {
  const Ridge straight{{}, 0.03, 0.99}, bent{{}, 0.03, 0.95, 0.5};
  for (const Ridge& shape : {straight, bent})
    for (const int d : {1, 2, 4}) {
      Ridge ridge = shape;
      ridge.centre = Eigen::VectorXd::Constant(d, 0.45);
      if (d == 1) ridge.bend = 0;
      // Ten standard deviations to both sides.
      const Eigen::VectorXd low = ridge.centre.array() - 0.3, high = ridge.centre.array() + 0.3;
      AskedPoints asked;
      const SurrogateDraws found = sample_by_surrogate(
          each_of([&](const Eigen::VectorXd& x) { return ridge.log_density(x); }), low, high, asked);
      EXPECT_TRUE(found.draws.enough);
      EXPECT_GE(found.agreement, SurrogateSettings().agreement);
      EXPECT_LT(asked.size(), 900);  // sample_by_importance takes 1,400 to 4,600
      expect_ridge(found.draws, ridge);
    }
}

TEST(SurrogateSampling, DrawsOfADensityLikeItSpareTheSearch) {
  Ridge ridge{Eigen::VectorXd::Constant(3, 0.45), 0.03, 0.95, 0.5};
  const Eigen::VectorXd low = Eigen::VectorXd::Zero(3), high = Eigen::VectorXd::Ones(3);
  const LogDensities density = each_of([&](const Eigen::VectorXd& x) { return ridge.log_density(x); });
  AskedPoints asked, again;
  const SurrogateDraws before = sample_by_surrogate(density, low, high, asked);
  ridge.centre.array() += 0.01;  // a third of a standard deviation
  const SurrogateDraws found = sample_by_surrogate(density, low, high, again, {.before = &before.draws});
  EXPECT_LT(again.size(), asked.size() / 3);
  expect_ridge(found.draws, ridge);
}

TEST(SurrogateSampling, ADensityThatNoSurrogateFollowsIsDrawnFromItself) {
  // Half of the cells of a chess board of 20 x 20 are empty.
  const auto is_black = [](const Eigen::VectorXd& x) {
    return (static_cast<int>(20 * x[0]) + static_cast<int>(20 * x[1])) % 2 == 0;
  };
  AskedPoints asked;
  const SurrogateDraws found =
      sample_by_surrogate(each_of([&](const Eigen::VectorXd& x) { return is_black(x) ? 0.0 : -50.0; }),
                          Eigen::Vector2d::Zero(), Eigen::Vector2d::Ones(), asked);
  const WeightedDraws& draws = found.draws;
  EXPECT_TRUE(draws.enough);
  double black = 0;
  for (Eigen::Index i = 0; i < draws.points.rows(); ++i)
    if (is_black(draws.points.row(i).transpose())) black += draws.weights[i];
  EXPECT_NEAR(black, 1, 1e-9);
  for (Eigen::Index k = 0; k < 2; ++k) {
    const double below = (draws.points.col(k).array() < 0.3).cast<double>().matrix().dot(draws.weights);
    EXPECT_NEAR(below, 0.3, 4 * std::sqrt(0.21 / draws.effective_size));
  }
}

TEST(SurrogateSampling, TheSameSeedGivesTheSameDraws) {
  const Ridge ridge{Eigen::VectorXd::Constant(2, 0.5), 0.03, 0.9, 0.5};
  const LogDensities density = each_of([&](const Eigen::VectorXd& x) { return ridge.log_density(x); });
  AskedPoints first, again;
  const Eigen::Vector2d low(0, 0), high(1, 1);
  const SurrogateDraws one = sample_by_surrogate(density, low, high, first),
                       two = sample_by_surrogate(density, low, high, again);
  EXPECT_EQ(one.draws.points, two.draws.points);
  EXPECT_EQ(one.draws.weights, two.draws.weights);
  EXPECT_EQ(first.points, again.points);
}

TEST(SurrogateSampling, WhatIsNoDensityIsRefused) {
  AskedPoints asked;
  EXPECT_THROW(sample_by_surrogate(each_of([](const Eigen::VectorXd&) { return NAN; }),
                                   Eigen::Vector2d::Zero(), Eigen::Vector2d::Ones(), asked),
               std::domain_error);
}

TEST(LogDensitySurrogate, IsExactOfAGaussianInBentCoordinates) {
  // A quadratic polynomial of bent coordinates, which the kernel need not touch.
  BentStudent bent{Eigen::Vector2d(0.4, 0.5), Eigen::Vector2d(10, 0), Eigen::Vector2d(0, 0.05),
                   Eigen::Matrix2d(Eigen::Vector2d(0.1, 0.02).asDiagonal())};
  const auto log_density = [&](const Eigen::MatrixXd& x) -> Eigen::VectorXd {
    return -0.5 * bent.white(x).rowwise().squaredNorm();
  };
  const auto points_of = [](unsigned seed, Eigen::Index count) {
    RandomNumbers random(seed);
    Eigen::MatrixXd points(count, 2);
    for (double& each : points.reshaped()) each = 0.3 + 0.3 * random.uniform();
    return points;
  };
  const Eigen::MatrixXd known = points_of(1, 30), others = points_of(2, 100);
  const LogDensitySurrogate surrogate({known, log_density(known)}, bent);
  const Eigen::VectorXd exact = log_density(others), found = surrogate(others);
  for (Eigen::Index i = 0; i < exact.size(); ++i) {
    if (exact[i] < -LogDensitySurrogate::kTold) continue;
    EXPECT_NEAR(found[i], exact[i], 0.05);
  }
}

}  // namespace
}  // namespace flash::sysid
