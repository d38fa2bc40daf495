#include "sysid/infer/importance_sampling.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "tests/sysid/infer/ridge.h"

namespace flash::sysid {
namespace {

WeightedDraws in_unit_box(const LogDensities& log_densities, Eigen::Index dimensions,
                          const ImportanceSettings& settings = {}) {
  return sample_by_importance(log_densities, Eigen::VectorXd::Zero(dimensions),
                              Eigen::VectorXd::Ones(dimensions), settings);
}

double normal_share(double z) { return 0.5 * std::erfc(-z / std::sqrt(2.0)); }

/// Weight of the draws below x, against the exact share: four standard deviations of as many independent
/// draws as the effective size states. A false alarm comes once in 16,000 looks.
void expect_share(const WeightedDraws& draws, Eigen::Index k, double x, double share) {
  const double below = (draws.points.col(k).array() < x).cast<double>().matrix().dot(draws.weights);
  EXPECT_NEAR(below, share, 4 * std::sqrt(share * (1 - share) / draws.effective_size))
      << "coordinate " << k << " at " << x;
}

void expect_ridge(const WeightedDraws& draws, const Ridge& ridge) {
  for (Eigen::Index k = 0; k < ridge.dimensions(); ++k)
    for (const double share : {0.025, 0.25, 0.5, 0.75, 0.975})
      expect_share(draws, k, ridge.quantile(k, share), share);
}

TEST(ImportanceSampling, RidgesHaveTheirQuantilesStraightBentAndStretched) {
  const Ridge straight{{}, 0.03, 0.99}, bent{{}, 0.03, 0.95, 0.5}, stretched{{}, 0.03, 0.9, 0, 0.4};
  for (const Ridge& shape : {straight, bent, stretched})
    for (const int d : {2, 4}) {
      Ridge ridge = shape;
      ridge.centre = Eigen::VectorXd::Constant(d, 0.4);
      const WeightedDraws draws =
          in_unit_box(each_of([&](const Eigen::VectorXd& x) { return ridge.log_density(x); }), d);
      EXPECT_TRUE(draws.enough);
      EXPECT_NEAR(draws.weights.sum(), 1, 1e-12);
      EXPECT_NEAR(draws.effective_size, 1 / draws.weights.squaredNorm(), 1e-9);
      expect_ridge(draws, ridge);
    }
}

TEST(ImportanceSampling, ABoundCutsAGaussianOff) {
  // About a corner of the box, in the units of the caller.
  const Eigen::Vector2d low(-3, 10), high(5, 50), sd(1, 4);
  const WeightedDraws draws = sample_by_importance(each_of([&](const Eigen::VectorXd& x) {
                                                     return -0.5 * (x - low).cwiseQuotient(sd).squaredNorm() +
                                                            1e4;  // up to a constant
                                                   }),
                                                   low, high);
  EXPECT_TRUE((draws.points.rowwise() - low.transpose()).minCoeff() >= 0);
  for (Eigen::Index k = 0; k < 2; ++k)
    for (const double z : {0.1, 0.6745, 1.5, 2.2})
      expect_share(draws, k, low[k] + z * sd[k], 2 * normal_share(z) - 1);
}

TEST(ImportanceSampling, TwoModesHaveTheirShares) {
  // 0.3 of the mass about 0.2, the rest about 0.8, of half the deviation.
  const WeightedDraws draws =
      in_unit_box(each_of([](const Eigen::VectorXd& x) {
                    const double first = (x.array() - 0.2).square().sum() / std::pow(0.04, 2),
                                 second = (x.array() - 0.8).square().sum() / std::pow(0.02, 2);
                    return std::log(0.3 / std::pow(0.04, 3) * std::exp(-first / 2) +
                                    0.7 / std::pow(0.02, 3) * std::exp(-second / 2) + 1e-300);
                  }),
                  3);
  EXPECT_TRUE(draws.enough);
  for (Eigen::Index k = 0; k < 3; ++k) {
    expect_share(draws, k, 0.2, 0.15);
    expect_share(draws, k, 0.5, 0.3);
    expect_share(draws, k, 0.8, 0.65);
  }
}

TEST(ImportanceSampling, AFlatDirectionStaysFlat) {
  const WeightedDraws draws = in_unit_box(
      each_of([](const Eigen::VectorXd& x) { return -0.5 * std::pow((x[0] - 0.5) / 0.01, 2); }), 3);
  EXPECT_TRUE(draws.enough);
  for (const double share : {0.025, 0.2, 0.5, 0.8, 0.975})
    for (const Eigen::Index k : {1, 2}) expect_share(draws, k, share, share);
  expect_share(draws, 0, 0.5 + 0.01 * 1.96, 0.975);
}

TEST(ImportanceSampling, OneCoordinateIsEnough) {
  const WeightedDraws draws = in_unit_box(
      each_of([](const Eigen::VectorXd& x) { return -0.5 * std::pow((x[0] - 0.3) / 0.001, 2); }), 1);
  for (const double z : {-1.96, 0.0, 1.96}) expect_share(draws, 0, 0.3 + 0.001 * z, normal_share(z));
}

TEST(ImportanceSampling, NothingIsFoundWhereTheDensityIsZero) {
  const auto density = [](double from) {
    return each_of([=](const Eigen::VectorXd& x) {
      return x[0] < from ? -INFINITY : -0.5 * std::pow((x[1] - 0.5) / 0.05, 2);
    });
  };
  const WeightedDraws draws = in_unit_box(density(0.5), 2);
  EXPECT_TRUE(draws.enough);
  expect_share(draws, 0, 0.75, 0.5);
  expect_share(draws, 1, 0.5 + 0.05, normal_share(1));
  EXPECT_EQ(((draws.points.col(0).array() < 0.5).cast<double>() * draws.weights.array()).sum(), 0);
  // A part that the first points miss is found by more of them.
  expect_share(in_unit_box(density(0.999), 2), 0, 0.9995, 0.5);
  EXPECT_THROW(in_unit_box(density(2), 2), std::domain_error);
}

TEST(ImportanceSampling, ASmallBudgetStatesItsSmallSize) {
  Ridge ridge{Eigen::VectorXd::Constant(6, 0.4), 0.03, 0.99, 0.5};
  const WeightedDraws draws =
      in_unit_box(each_of([&](const Eigen::VectorXd& x) { return ridge.log_density(x); }), 6, {.most = 1000});
  EXPECT_FALSE(draws.enough);
  EXPECT_LT(draws.effective_size, 100);
  EXPECT_LT(draws.points.rows(), 1000 + 128);
}

TEST(ImportanceSampling, TheSameSeedGivesTheSameDraws) {
  const Ridge ridge{Eigen::VectorXd::Constant(3, 0.5), 0.03, 0.95, 0.5};
  const LogDensities density = each_of([&](const Eigen::VectorXd& x) { return ridge.log_density(x); });
  const WeightedDraws first = in_unit_box(density, 3), again = in_unit_box(density, 3),
                      other = in_unit_box(density, 3, {.seed = 2});
  EXPECT_EQ(first.points, again.points);
  EXPECT_EQ(first.weights, again.weights);
  EXPECT_NE(first.points.topRows(10), other.points.topRows(10));
}

TEST(ImportanceSampling, ResampledDrawsHaveTheQuantilesOfTheWeights) {
  const WeightedDraws draws = in_unit_box(
      each_of([](const Eigen::VectorXd& x) { return -0.5 * std::pow((x[0] - 0.3) / 0.02, 2); }), 1);
  constexpr Eigen::Index kCount = 4000;
  Eigen::MatrixXd equal = draws.resampled(kCount);
  std::sort(equal.data(), equal.data() + kCount);
  // Systematic resampling is off by one draw of the ordered ones, here of any: each has about its weight.
  for (const double share : {0.1, 0.5, 0.9})
    EXPECT_NEAR(equal(static_cast<Eigen::Index>(share * kCount), 0), draws.quantile(0, share), 0.02 / 5);
}

TEST(ImportanceSampling, WhatIsNoDensityOrNoBoxIsRefused) {
  const auto constant = [](double log) { return each_of([=](const Eigen::VectorXd&) { return log; }); };
  EXPECT_THROW(in_unit_box(constant(NAN), 2), std::domain_error);
  EXPECT_THROW(in_unit_box(constant(INFINITY), 2), std::domain_error);
  EXPECT_THROW(in_unit_box(constant(-INFINITY), 2), std::domain_error);
  const Eigen::Vector2d zero(0, 0), one(1, 1), flat(1, 0);
  EXPECT_THROW(sample_by_importance(constant(0), zero, flat), std::invalid_argument);
  EXPECT_THROW(sample_by_importance(constant(0), one, zero), std::invalid_argument);
  EXPECT_THROW(sample_by_importance(constant(0), zero, Eigen::Vector3d(1, 1, 1)), std::invalid_argument);
}

}  // namespace
}  // namespace flash::sysid
