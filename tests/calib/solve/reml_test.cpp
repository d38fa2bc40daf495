#include "calib/solve/reml.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <cstdio>
#include <random>

namespace flash::calib {
namespace {

constexpr int kGroups = 12, kRepeats = 5;

/// One-way layout y_ij = s + d_i + e_ij, d_i with a prior of its own standard deviation.
LinearModel one_way(double between, double within, unsigned seed, std::vector<double>& y) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  LinearModel model{.groups = kGroups, .components = 2, .own = 1, .shared = 1, .blocks = {}};
  for (int i = 0; i < kGroups; ++i) {
    const double effect = between * normal(random);
    Eigen::MatrixXd rows(kRepeats, 3);
    for (int j = 0; j < kRepeats; ++j) {
      y.push_back(3 + effect + within * normal(random));
      rows.row(j) << 1, 1, -y.back();
    }
    model.blocks.push_back({i, 0, kRepeats, rows.transpose() * rows});
    Eigen::RowVector3d prior(1, 0, 0);
    model.blocks.push_back({i, 1, 1, prior.transpose() * prior});
  }
  return model;
}

struct AnalysisOfVariance {
  double mean = 0, within = 0, between = 0;
};

AnalysisOfVariance analyse(const std::vector<double>& y) {
  AnalysisOfVariance result;
  double inside = 0, outside = 0;
  for (const double value : y) result.mean += value / static_cast<double>(y.size());
  for (int i = 0; i < kGroups; ++i) {
    double mean = 0;
    for (int j = 0; j < kRepeats; ++j) mean += y[static_cast<std::size_t>(i * kRepeats + j)] / kRepeats;
    for (int j = 0; j < kRepeats; ++j)
      inside += std::pow(y[static_cast<std::size_t>(i * kRepeats + j)] - mean, 2);
    outside += kRepeats * std::pow(mean - result.mean, 2);
  }
  inside /= kGroups * (kRepeats - 1);
  outside /= kGroups - 1;
  result.within = std::sqrt(inside);
  result.between = std::sqrt(std::max(0.0, (outside - inside) / kRepeats));
  return result;
}

TEST(VarianceComponents, BalancedOneWayLayoutGivesTheAnalysisOfVariance) {
  std::vector<double> y;
  const LinearModel model = one_way(2, 0.5, 1, y);
  const AnalysisOfVariance expected = analyse(y);
  for (const double start : {0.01, 1.0, 50.0}) {
    const VarianceComponents found = estimate_variance_components(model, {start, start}, {1e-6, 1e-6});
    EXPECT_TRUE(found.converged);
    EXPECT_NEAR(found.sigmas[0], expected.within, 1e-5 * expected.within);
    EXPECT_NEAR(found.sigmas[1], expected.between, 1e-5 * expected.between);
    // Of log sigma: 1 / sqrt(2 n) for n independent residuals.
    EXPECT_NEAR(std::sqrt(found.log_covariance(0, 0)), 1 / std::sqrt(2.0 * kGroups * (kRepeats - 1)), 1e-3);
  }
  const LinearSolution solution = solve_linear(model, {expected.within, expected.between});
  EXPECT_NEAR(solution.shared[0], expected.mean, 1e-12);
  EXPECT_NEAR(1 / solution.information(0, 0),
              std::pow(expected.between, 2) / kGroups + std::pow(expected.within, 2) / (kGroups * kRepeats),
              1e-12);
  EXPECT_NEAR(solution.redundancy.sum(), kGroups * kRepeats - 1, 1e-9);
}

TEST(VarianceComponents, ComponentThatIsNotThereGoesToItsFloor) {
  std::vector<double> y;
  unsigned seed = 1;
  LinearModel model = one_way(0, 0.5, seed, y);
  while (analyse(y).between > 0) {
    y.clear();
    model = one_way(0, 0.5, ++seed, y);
  }
  const VarianceComponents found = estimate_variance_components(model, {1, 1}, {1e-6, 1e-6});
  EXPECT_LT(found.sigmas[1],
            0.02);  // a tenth of what the mean of five repeats can show: the deviance is flat
  EXPECT_NEAR(found.sigmas[0], 0.5, 0.2);
}

TEST(VarianceComponents, DevianceIsMinusTwiceTheLogOfTheRestrictedLikelihood) {
  std::vector<double> y;
  const LinearModel model = one_way(1, 0.7, 3, y);
  // By brute force: y ~ N(1 s, V), s integrated over: log det V + log det(1' V^-1 1) + y' P y.
  const auto dense = [&](double within, double between) {
    const Eigen::Index n = kGroups * kRepeats;
    Eigen::MatrixXd V = within * within * Eigen::MatrixXd::Identity(n, n);
    for (int i = 0; i < kGroups; ++i)
      V.block(i * kRepeats, i * kRepeats, kRepeats, kRepeats).array() += between * between;
    const Eigen::Map<const Eigen::VectorXd> data(y.data(), n);
    const Eigen::MatrixXd W = V.inverse();
    const Eigen::VectorXd ones = Eigen::VectorXd::Ones(n);
    const double information = ones.dot(W * ones);
    return std::log(V.determinant()) + std::log(information) + data.dot(W * data) -
           std::pow(ones.dot(W * data), 2) / information;
  };
  const auto fast = [&](double within, double between) {
    return solve_linear(model, {within, between}).deviance;
  };
  EXPECT_NEAR(fast(0.5, 2) - fast(0.9, 0.4), dense(0.5, 2) - dense(0.9, 0.4), 1e-8);
}

TEST(VarianceComponents, WithoutResidualsStandsInItsUsualRatioToTheOther) {
  std::mt19937 random(4);
  std::normal_distribution<double> normal;
  LinearModel model{.groups = 1, .components = 2, .own = 0, .shared = 1, .blocks = {}};
  Eigen::MatrixXd rows(20, 2);
  for (int j = 0; j < 20; ++j) rows.row(j) << 1, normal(random);
  model.blocks = {{0, 0, 20, rows.transpose() * rows}};
  const double alone = estimate_variance_components(model, {1, 5}, {1e-6, 1e-6}).sigmas[0];
  model.noise.ratios = {{.over = 1, .under = 0, .usual = 3, .spread = 0.5}};
  const VarianceComponents found = estimate_variance_components(model, {1, 5}, {1e-6, 1e-6});
  EXPECT_TRUE(found.converged);
  EXPECT_NEAR(found.sigmas[0], alone, 1e-5 * alone);  // what tells nothing pulls nothing
  EXPECT_NEAR(found.sigmas[1], 3 * alone, 1e-5 * alone);
}

// The mode of a log-normal prior times the likelihood of n squares: n (1 - q / sigma^2) + d / spread^2 = 0,
// d = log(sigma_1 / (usual sigma_0)), with a first component that hardly moves.
TEST(VarianceComponents, RatioIsWeighedAsItsDensity) {
  constexpr double kMany = 1e6, kFew = 10, kSpread = 0.5;
  LinearModel model{.groups = 1, .components = 2, .own = 0, .shared = 1, .blocks = {}};
  const Eigen::Matrix2d squares = Eigen::Vector2d(1e-12, 1).asDiagonal();  // [J r]^T [J r] for each residual
  model.blocks = {{0, 0, kMany, kMany * squares}, {0, 1, kFew, kFew * squares}};
  model.noise.ratios = {{.over = 1, .under = 0, .usual = 3, .spread = kSpread}};
  const std::vector<double> sigmas = estimate_variance_components(model, {1, 1}, {1e-6, 1e-6}).sigmas;
  const double pull = std::log(sigmas[1] / (3 * sigmas[0])) / (kSpread * kSpread);
  EXPECT_NEAR(sigmas[0], 1, 1e-4);
  EXPECT_NEAR(kFew * (1 - 1 / (sigmas[1] * sigmas[1])) + pull, 0, 1e-3);
  EXPECT_GT(sigmas[1], 1.1);
}

TEST(VarianceComponents, MeanOfFewRepeatsHasTheVarianceOfStudentsDistribution) {
  for (const int count : {9, 16, 41}) {
    std::mt19937 random(4);
    std::normal_distribution<double> normal;
    LinearModel model{.groups = 1, .components = 1, .own = 0, .shared = 1, .blocks = {}};
    Eigen::MatrixXd rows(count, 2);
    for (int j = 0; j < count; ++j) rows.row(j) << 1, normal(random);
    model.blocks.push_back({0, 0, static_cast<double>(count), rows.transpose() * rows});
    const VarianceComponents found = estimate_variance_components(model, {1}, {1e-6});
    const double freedom = count - 1, of_mean = std::pow(found.sigmas[0], 2) / count;
    EXPECT_NEAR(adjusted_covariance(model, found)(0, 0) / of_mean, freedom / (freedom - 2), 0.01);
  }
}

/// The layout above with mean squares between and within groups that are `ratio` to one exactly.
LinearModel one_way_of(int groups, double ratio) {
  constexpr int kEach = 6;
  LinearModel model{.groups = groups, .components = 2, .own = 1, .shared = 1, .blocks = {}};
  Eigen::VectorXd means = Eigen::VectorXd::LinSpaced(groups, -1, 1);
  means *= std::sqrt(ratio / kEach * (groups - 1) / means.squaredNorm());
  Eigen::VectorXd within = Eigen::VectorXd::LinSpaced(kEach, -1, 1);
  within *= std::sqrt((kEach - 1) / within.squaredNorm());
  for (int i = 0; i < groups; ++i) {
    Eigen::MatrixXd rows(kEach, 3);
    for (int j = 0; j < kEach; ++j) rows.row(j) << 1, 1, -(means[i] + within[j]);
    model.blocks.push_back({i, 0, kEach, rows.transpose() * rows});
    Eigen::RowVector3d prior(1, 0, 0);
    model.blocks.push_back({i, 1, 1, prior.transpose() * prior});
  }
  return model;
}

TEST(VarianceComponents, MeanOfFewGroupsIsLessCertainHoweverWeakTheirSpread) {
  // The mean of the groups' means is Student's with one degree less than groups, whatever the components.
  for (const auto& [groups, ratio] :
       {std::pair{8, 3.0}, {10, 2.0}, {15, 2.0}, {20, 2.0}, {10, 20.0}, {20, 20.0}}) {
    const LinearModel model = one_way_of(groups, ratio);
    const VarianceComponents found = estimate_variance_components(model, {1, 1}, {1e-6, 1e-6});
    const double plugged_in = 1 / solve_linear(model, found.sigmas).information(0, 0);
    const double factor = adjusted_covariance(model, found)(0, 0) / plugged_in;
    const double student = (groups - 1.0) / (groups - 3.0);
    std::printf("%d groups, ratio %.0f: %.3f, Student's %.3f\n", groups, ratio, factor, student);
    EXPECT_GT(factor, 1);
    EXPECT_LT(factor, 1.1 * student);
    EXPECT_GT(factor, 0.9 * student);
  }
}

TEST(VarianceComponents, WhatIsUsualDecidesWhereThereIsNothingElse) {
  // One residual of each of two components, whose sizes are anything: the prior's equation alone is left.
  LinearModel model = one_way_of(2, 2.0);
  const double free = estimate_variance_components(model, {1, 1}, {1e-6, 1e-6}).sigmas[1];
  model.noise = {{1, 0.1}, 1e-4};
  const VarianceComponents held = estimate_variance_components(model, {1, 1}, {1e-6, 1e-6});
  EXPECT_NEAR(held.sigmas[1], 0.1, 1e-5);
  EXPECT_GT(std::abs(free - 0.1), 0.1);
  // A wide one changes nothing; its gradient is that of the deviance by finite differences.
  model.noise = {{1, 0.1}, 1e4};
  EXPECT_NEAR(estimate_variance_components(model, {1, 1}, {1e-6, 1e-6}).sigmas[1], free, 1e-5);
  model.noise = {{0.7, 0.1}, 1};
  const VarianceComponents found = estimate_variance_components(model, {1, 1}, {1e-6, 1e-6});
  for (std::size_t c = 0; c < 2; ++c) {
    std::vector<double> up = found.sigmas, down = found.sigmas;
    up[c] *= 1 + 1e-4;
    down[c] *= 1 - 1e-4;
    const double slope = (solve_linear(model, up).deviance - solve_linear(model, down).deviance) / 2e-4;
    EXPECT_NEAR(slope, 0, 1e-4);
  }
}

TEST(VarianceComponents, TailsGrowAsTablesOfTheFDistributionSay) {
  // Upper 1 % points of F with 6 and so many degrees of freedom (Abramowitz and Stegun 1964, table 26.9).
  for (const auto& [freedom, point] : {std::pair{6.0, 8.47}, {10.0, 5.39}, {20.0, 3.87}, {60.0, 3.12}})
    EXPECT_NEAR(tail_growth(freedom) * 16.812 / 6 * freedom / (freedom - 2), point, 0.006);
}

}  // namespace
}  // namespace flash::calib
