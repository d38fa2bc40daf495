#include "sysid/infer/posterior.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "sysid/infer/ensemble_sampler.h"

namespace flash::sysid {
namespace {

/// Deviance at the points of a grid of two axes.
template <class Function>
Eigen::VectorXd over(const std::vector<Axis>& axes, const Function& deviance) {
  const std::vector<std::vector<double>> points = cartesian_product(axes);
  Eigen::VectorXd values(static_cast<Eigen::Index>(points.size()));
  for (std::size_t i = 0; i < points.size(); ++i)
    values[static_cast<Eigen::Index>(i)] =
        deviance(coordinate_of(axes[0], points[i][0]), coordinate_of(axes[1], points[i][1]));
  return values;
}

/// A curved valley that a range cuts off.
double valley(double x, double y) {
  const double across = y - 0.4 - 0.5 * x * x;
  return std::pow((x - 0.2) / 0.5, 2) + std::pow(across / 0.1, 2);
}

TEST(Posterior, QuantilesAreThoseOfNestedQuadrature) {
  const std::vector<Axis> axes = {parse_axis("start_yaw", "-1:1:17"), parse_axis("friction", "0:1:17")};
  const Posterior posterior = explore_posterior(axes, over(axes, valley));
  constexpr int kFine = 800;
  std::vector<double> x_mass(kFine, 0), y_mass(kFine, 0);
  double total = 0;
  for (int i = 0; i < kFine; ++i)
    for (int j = 0; j < kFine; ++j) {
      const double mass = std::exp(-0.5 * valley(-1 + 2 * (i + 0.5) / kFine, (j + 0.5) / kFine));
      x_mass[static_cast<std::size_t>(i)] += mass;
      y_mass[static_cast<std::size_t>(j)] += mass;
      total += mass;
    }
  const auto share_below = [&](const std::vector<double>& mass, double position) {
    double sum = 0;
    for (int i = 0; i < static_cast<int>(position * kFine); ++i) sum += mass[static_cast<std::size_t>(i)];
    return sum / total;
  };
  // 12,800 draws of some 30 sweeps' memory are worth 1,600 or more: 3 sd of a share at the median and the
  // ends.
  for (const double share : {0.025, 0.25, 0.5, 0.75, 0.975}) {
    const double tolerance = 3 * std::sqrt(share * (1 - share) / 1600);
    EXPECT_NEAR(share_below(x_mass, (posterior.quantile(0, share) + 1) / 2), share, tolerance);
    EXPECT_NEAR(share_below(y_mass, posterior.quantile(1, share)), share, tolerance);
  }
  EXPECT_NEAR(posterior.estimate[0], 0.2, 1e-2);
  EXPECT_NEAR(posterior.estimate[1], 0.42, 1e-2);
}

TEST(Posterior, EachPointSpeaksUpToItsNeighboursWhateverTheLevelOfTheDeviance) {
  // The second axis is of one value.
  const std::vector<Axis> axes = {parse_axis("start_yaw", "0:1:5"), parse_axis("friction", "0.3")};
  Eigen::VectorXd deviance(5);
  deviance << 2.2, 0, 3.0, 900, 1.4;
  // Between two points there is half of what an inner one has, and all of what one at an end has.
  Eigen::VectorXd mass = (-0.5 * deviance.array()).exp() * Eigen::Array<double, 5, 1>(1, 2, 2, 2, 1);
  mass /= mass.sum();
  const Eigen::Vector4d between(mass[0] + mass[1] / 2, mass[1] / 2 + mass[2] / 2, mass[2] / 2 + mass[3] / 2,
                                mass[3] / 2 + mass[4]);
  for (const double level : {-2e4, 0.0, 2e4}) {
    const Posterior posterior = explore_at_points(axes, deviance.array() + level);
    EXPECT_EQ(posterior.values(), (std::vector<double>{0.25, 0.3}));
    EXPECT_NEAR(posterior.ends(0, 0), 2.2, 1e-9);
    EXPECT_NEAR(posterior.ends(0, 1), 1.4, 1e-9);
    const Eigen::ArrayXd draws = posterior.samples.col(0);
    const auto count = static_cast<double>(draws.size());
    for (int k = 0; k < 4; ++k)
      for (const int half : {1, 2}) {  // even between two points
        const double low = 0.25 * k, high = low + 0.125 * half, share = between[k] * half / 2;
        const auto inside = static_cast<double>(((draws > low) && (draws < high)).count());
        EXPECT_NEAR(inside / count, share, 4 * std::sqrt(share * (1 - share) / count));
      }
  }
}

TEST(Posterior, AMixtureHasItsShareOfEachsDraws) {
  const std::vector<Axis> narrow = {parse_axis("start_yaw", "0.2:0.4:17")},
                          wide = {parse_axis("start_yaw", "0:1:3")};
  Eigen::VectorXd valley(17), points(3);
  for (int i = 0; i < 17; ++i) valley[i] = std::pow((i - 8) / 3.0, 2);
  points << 900, 2, 0;  // none of its draws is below 0.5 but a few of the middle's
  const Posterior by_valley = explore_posterior(narrow, valley), by_points = explore_at_points(wide, points);
  const auto below = [](const Posterior& posterior) {
    return (posterior.samples.col(0).array() < 0.45).cast<double>().mean();
  };
  const double of_points = below(by_points);
  ASSERT_LT(of_points, 0.5);
  for (const double share : {0.0, 1e-3, 0.3, 1.0}) {
    const Posterior mixed = mixture(by_valley, by_points, share);
    EXPECT_NEAR(below(mixed), 1 - share + share * of_points, 0.005);
    EXPECT_EQ(mixed.values(), by_points.values());
    EXPECT_EQ(mixed.axes.front().values, wide.front().values);
    for (const int side : {0, 1})  // likelihoods there, over the likeliest, in their shares
      EXPECT_NEAR(std::exp(-0.5 * mixed.ends(0, side)),
                  (1 - share) * std::exp(-0.5 * by_valley.ends(0, side)) +
                      share * std::exp(-0.5 * by_points.ends(0, side)),
                  1e-12);
  }
  EXPECT_EQ(mixture(by_valley, by_points, 0).samples, by_valley.samples);
  EXPECT_EQ(mixture(by_valley, by_points, 1).samples, by_points.samples);
}

// Draws in one cell lie anywhere between its ends; what is at a searched value reaches to both beside it.
TEST(Posterior, WhatIsKnownAtSearchedValuesAloneReachesToTheirNeighbours) {
  const std::vector<Axis> searched = {parse_axis("bending", "1e-5:1e-3:5:log"),
                                      parse_axis("friction", "0.3")};
  const std::vector<double>& knots = searched[0].values;
  const auto narrow_about = [&](double value) {
    std::vector<Axis> fine = searched;
    fine[0].values.clear();
    Eigen::VectorXd deviance(17);
    for (int i = 0; i < 17; ++i) {
      fine[0].values.push_back(value * std::exp(0.002 * (i - 8)));
      deviance[i] = std::pow((i - 8) / 2.0, 2);
    }
    return up_to_neighbours(explore_posterior(fine, deviance), searched);
  };
  const double inside = 0.5 * (knots[1] + knots[2]);
  const Posterior between = narrow_about(inside);
  EXPECT_NEAR(std::exp(between.reach(0, 0)), knots[1], 1e-9 * knots[1]);
  EXPECT_NEAR(std::exp(between.reach(0, 1)), knots[2], 1e-9 * knots[2]);
  EXPECT_NEAR(between.values()[0], inside, 1e-3 * inside);
  const Eigen::ArrayXd draws = between.samples.col(0).array();
  EXPECT_GE(draws.minCoeff(), std::log(knots[1]));
  EXPECT_LE(draws.maxCoeff(), std::log(knots[2]));
  const auto count = static_cast<double>(draws.size());
  const double middle = 0.5 * (std::log(knots[1]) + std::log(knots[2]));
  EXPECT_NEAR((draws < middle).cast<double>().mean(), 0.5, 4 * std::sqrt(0.25 / count));
  EXPECT_EQ(between.samples.col(1).minCoeff(), 0.3);
  EXPECT_EQ(between.samples.col(1).maxCoeff(), 0.3);

  const Posterior at = narrow_about(knots[2]);
  EXPECT_NEAR(std::exp(at.reach(0, 0)), knots[1], 1e-9 * knots[1]);
  EXPECT_NEAR(std::exp(at.reach(0, 1)), knots[3], 1e-9 * knots[3]);
  // Nothing was searched beyond the last value.
  EXPECT_NEAR(std::exp(narrow_about(0.999 * knots[4]).reach(0, 1)), knots[4], 1e-9 * knots[4]);
}

TEST(Posterior, BothOfTwoValleysAreDrawnFrom) {
  const std::vector<Axis> axes = {parse_axis("start_yaw", "-1:1:33"), parse_axis("friction", "0.3")};
  const Posterior posterior =
      explore_posterior(axes, over(axes, [](double x, double) {
                          return -2 * std::log(0.3 * std::exp(-0.5 * std::pow((x + 0.6) / 0.08, 2)) +
                                               0.7 * std::exp(-0.5 * std::pow((x - 0.5) / 0.08, 2)));
                        }));
  const double left = (posterior.samples.col(0).array() < 0).cast<double>().mean();
  EXPECT_NEAR(left, 0.3, 0.15);  // of 64 walkers few change sides: sd 0.06
  EXPECT_EQ(posterior.samples.col(1).minCoeff(), 0.3);
}

// Simulation-based calibration (Talts et al. 2018): parameters from the prior, data from the parameters; the
// rank of the truth among draws of its posterior is even.
TEST(Posterior, RanksOfTheTruthAreEven) {
  constexpr int kProblems = 300, kBins = 10;
  const std::vector<Axis> axes = {parse_axis("start_yaw", "-1:1:13"), parse_axis("friction", "0:1:13")};
  std::mt19937 random(11);
  std::uniform_real_distribution<double> uniform;
  std::normal_distribution<double> normal;
  std::array<std::array<int, kBins>, 2> ranks{};
  for (int problem = 0; problem < kProblems; ++problem) {
    const std::array<double, 2> truth = {2 * uniform(random) - 1, uniform(random)};
    // Two nonlinear looks with an error that leaves a valley.
    const auto first = [](double x, double y) { return std::sin(x) + 0.8 * y; };
    const auto second = [](double x, double y) { return x * y - 0.3 * x; };
    const double a = first(truth[0], truth[1]) + 0.1 * normal(random);
    const double b = second(truth[0], truth[1]) + 0.3 * normal(random);
    const Posterior posterior = explore_posterior(axes,
                                                  over(axes,
                                                       [&](double x, double y) {
                                                         return std::pow((first(x, y) - a) / 0.1, 2) +
                                                                std::pow((second(x, y) - b) / 0.3, 2);
                                                       }),
                                                  static_cast<unsigned>(problem + 1));
    for (const Eigen::Index k : {0, 1}) {
      const double below =
          (posterior.samples.col(k).array() < truth[static_cast<std::size_t>(k)]).cast<double>().mean();
      ++ranks[static_cast<std::size_t>(k)][static_cast<std::size_t>(std::min(kBins - 1.0, below * kBins))];
    }
  }
  for (const auto& counts : ranks) {
    double chi2 = 0;
    for (const int count : counts)
      chi2 += std::pow(count - kProblems / kBins, 2) / (static_cast<double>(kProblems) / kBins);
    EXPECT_LT(chi2, 21.67);  // 99 % at 9 degrees of freedom
  }
}

TEST(Ensemble, DrawsHaveMeanAndCovarianceOfANormalOfAnyScale) {
  Eigen::Matrix3d root;
  root << 1, 0, 0, 300, 40, 0, 1e-3, 2e-3, 1e-3;
  const Eigen::Matrix3d covariance = root * root.transpose(), inverse = covariance.inverse();
  const Eigen::Vector3d mean(1, -20, 3e-3);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(-1, 1);
  Eigen::MatrixXd start(64, 3);
  for (Eigen::Index i = 0; i < 64; ++i)
    start.row(i) << mean[0] + uniform(random), mean[1] + 300 * uniform(random),
        mean[2] + 2e-3 * uniform(random);
  const Eigen::MatrixXd draws =
      sample_ensemble([&](const Eigen::VectorXd& x) { return -0.5 * (x - mean).dot(inverse * (x - mean)); },
                      start, {500, 4000, 4, 5});
  const Eigen::RowVectorXd found = draws.colwise().mean();
  for (Eigen::Index k = 0; k < 3; ++k) {
    const double sd = std::sqrt(covariance(k, k));
    const double spread = std::sqrt((draws.col(k).array() - found[k]).square().mean());
    EXPECT_NEAR(found[k], mean[k], 0.06 * sd);  // 64,000 draws worth 4,000 or more: 4 sd
    EXPECT_NEAR(spread, sd, 0.06 * sd);
  }
}

}  // namespace
}  // namespace flash::sysid
