#include "sysid/infer/discrepancy.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <random>

#include "sysid/infer/local_noise.h"
#include "sysid/infer/residual_likelihood.h"
#include "tests/sysid/infer/strip_rows.h"

namespace flash::sysid {
namespace {

/// How the rows of a strip would move with a parameter: later and farther out, more.
Eigen::VectorXd lifted(const ObservedRows& rows) {
  Eigen::VectorXd rate(rows.weights.size());
  for (Eigen::Index i = 0; i < rate.size(); ++i) {
    const double t = rows.times[static_cast<std::size_t>(rows.keyframe[static_cast<std::size_t>(i)])] / 0.8;
    rate[i] = 0.05 * t * t * std::pow(rows.places(i, 0) / 0.2, 2);
  }
  return rate;
}

// Three markers at rest: nothing tells what is rough from what is smooth.
TEST(Discrepancy, NoiseAndMisfitOfAFewMarkersAreWhatTheParametersLeave) {
  ObservedRows rows;
  rows.times = {4};
  rows.places.resize(9, 2);
  rows.weights = Eigen::VectorXd::Ones(9);
  for (int i = 0; i < 9; ++i) {
    rows.keyframe.push_back(0);
    rows.channel.push_back(i % 3);
    rows.places.row(i) << 0.1, 0.015 * (i / 3);
  }
  rows.rates = Eigen::VectorXd::LinSpaced(9, -6e-3, 2e-3);
  constexpr int kSeeds = 200;
  double sum = 0;
  for (unsigned seed = 0; seed < kSeeds; ++seed) {
    std::mt19937 random(seed);
    const Eigen::VectorXd y = kNoise * normal(random, 9) + rows.rates;
    const DiscrepancyModel model(rows, y);
    sum += std::pow(model.noise(), 2) + std::pow(model.misfit().size, 2);
    EXPECT_FALSE(model.misfit().found);
    const ResidualLikelihood likelihood(rows, y);
    EXPECT_TRUE(std::isfinite(likelihood.deviance(y)));
    // Rows have the whole variance, in the mean over them.
    const Eigen::MatrixXd each = model.covariance_of(Eigen::MatrixXd::Identity(9, 9));
    EXPECT_NEAR(each.trace() / 9, 2 * model.noise() * model.noise(), 1e-9 * model.noise() * model.noise());
  }
  // Sum of squares over eight degrees of freedom; its mean over the seeds scatters by sqrt(2 / 8 / 200) = 3.5
  // %.
  EXPECT_NEAR(sum / kSeeds, kNoise * kNoise, 0.15 * kNoise * kNoise);
}

// What a plan reckons with in another recording is what the covariance of this one has: the mean of the
// variance, not of the size.
TEST(Discrepancy, ItsMeanSquareIsTheMeanVarianceOfRowsBeyondNoise) {
  const ObservedRows rows = strip_rows(9, 40);
  const Eigen::Index count = rows.weights.size();
  for (unsigned seed = 1; seed < 6; ++seed) {
    std::mt19937 random(seed);
    Eigen::VectorXd y = kNoise * normal(random, count);
    y += 1e-3 * seed * lifted(rows) / 0.05;
    const DiscrepancyModel model(rows, y);
    const Misfit& misfit = model.misfit();
    const double variance =
        model.covariance_of(Eigen::MatrixXd::Identity(count, count)).trace() / static_cast<double>(count) -
        model.noise() * model.noise();
    EXPECT_EQ(misfit.rough, model.noise());
    EXPECT_GE(misfit.rms, misfit.size);
    // Cosines have unit mean square over the sheet; over forty places along it, to a hundredth.
    EXPECT_NEAR(misfit.rms * misfit.rms, variance, 0.02 * variance) << seed;
  }
}

TEST(Discrepancy, IsTheSameOnAnyThreads) {
  ObservedRows rows = strip_rows(9, 40);
  for (std::size_t i = 0; i < rows.channel.size(); ++i) rows.channel[i] = i % 5 == 0;
  rows.rates = lifted(rows);
  std::mt19937 random(3);
  const Eigen::VectorXd y = kNoise * normal(random, rows.weights.size()) + 0.01 * rows.rates;
  const DiscrepancyModel one(rows, y), four(rows, y, {}, 4);
  for (std::size_t shape = 0; shape < one.shapes().size(); ++shape)
    EXPECT_EQ(one.deviance_at(y, shape, 2e-3), four.deviance_at(y, shape, 2e-3));
  EXPECT_EQ(one.misfit().size, four.misfit().size);
  EXPECT_EQ(one.misfit().noise, four.misfit().noise);
  EXPECT_EQ(one.covariance_of(rows.rates), four.covariance_of(rows.rates));
}

TEST(Discrepancy, LikelihoodIsThatOfTheDenseCovariance) {
  ObservedRows rows = strip_rows(3, 47);  // of which all coordinates are kept
  std::mt19937 random(1);
  for (std::size_t i = 0; i < rows.channel.size(); ++i) rows.channel[i] = i % 5 == 0;
  rows.weights = normal(random, rows.weights.size()).cwiseAbs2().cwiseMin(1);
  rows.known = 2e-3 * Eigen::MatrixXd(normal(random, rows.weights.size()));
  const Eigen::VectorXd y = kNoise * normal(random, rows.weights.size()) + 3e-3 * rows.known.rowwise().sum();
  const DiscrepancyModel model(rows, y);
  const auto dense = [&](const Eigen::VectorXd& values, std::size_t shape, double tau) {
    const Eigen::MatrixXd noise =
        (model.noise() * model.noise()) * Eigen::MatrixXd(rows.weights.cwiseInverse().asDiagonal());
    const Eigen::MatrixXd covariance =
        noise + rows.known * rows.known.transpose() + tau * tau * model.covariance(shape);
    const Eigen::LLT<Eigen::MatrixXd> llt(covariance);
    return values.dot(llt.solve(values)) + 2 * Eigen::MatrixXd(llt.matrixL()).diagonal().array().log().sum();
  };
  const Eigen::VectorXd other = y + 2e-3 * lifted(rows) / 0.05;
  const double constant = dense(y, 0, 0) - model.deviance_at(y, 0, 0);
  for (const std::size_t shape : {std::size_t{0}, std::size_t{4}, model.shapes().size() - 1})
    for (const double tau : {0.0, 1e-4, 1e-3, 5e-3})
      for (const Eigen::VectorXd& values : {y, other})
        // Coordinates of a variance below a hundred thousandth of the largest are left out.
        EXPECT_NEAR(model.deviance_at(values, shape, tau) + constant, dense(values, shape, tau),
                    1e-3 * std::abs(dense(values, shape, tau)))
            << shape << " " << tau;
}

TEST(Discrepancy, CovarianceOfCombinationsIsThatOfTheDenseOne) {
  ObservedRows rows = strip_rows(7, 20);
  std::mt19937 random(2);
  for (std::size_t i = 0; i < rows.channel.size(); ++i) rows.channel[i] = i % 5 == 0;
  rows.weights = normal(random, rows.weights.size()).cwiseAbs2().cwiseMin(1);
  rows.known = 2e-3 * Eigen::MatrixXd(normal(random, rows.weights.size()));
  // A discrepancy far above the noise, of one shape: its likelihood is told.
  const DiscrepancyModel any(rows, kNoise * normal(random, rows.weights.size()));
  const std::size_t shape = 6;
  const Eigen::MatrixXd unit = any.covariance(shape);
  const Eigen::MatrixXd root =
      Eigen::MatrixXd((unit + 1e-9 * Eigen::MatrixXd::Identity(unit.rows(), unit.cols())).llt().matrixL());
  const Eigen::VectorXd y =
      kNoise * normal(random, unit.rows()) + 0.01 * (root * normal(random, unit.rows()));
  const DiscrepancyModel model(rows, y);
  // The mean over shapes and sizes, from the likelihood of each.
  double total = 0;
  Eigen::MatrixXd mean = Eigen::MatrixXd::Zero(unit.rows(), unit.cols());
  const double sigma = model.noise();
  const double first = 0.03 * sigma, ratio = model.residual_size() / first;
  double priors = 0;
  for (int i = 0; i < 20; ++i) {
    const double tau = first * std::pow(ratio, i / 19.0);
    priors += tau * std::exp(-std::log(20.0) * tau / sigma);
  }
  for (std::size_t f = 0; f < model.shapes().size(); ++f)
    for (int i = -1; i < 20; ++i) {
      const double tau = i < 0 ? 0 : first * std::pow(ratio, i / 19.0);
      const double prior = i < 0 ? priors : tau * std::exp(-std::log(20.0) * tau / sigma);
      const double weight =
          prior * std::exp(-0.5 * (model.deviance_at(y, f, tau) - model.deviance_at(y, shape, 0.01)));
      total += weight;
      mean += weight * tau * tau * model.covariance(f);
    }
  const Eigen::MatrixXd noise = sigma * sigma * Eigen::MatrixXd(rows.weights.cwiseInverse().asDiagonal());
  const Eigen::MatrixXd dense = noise + rows.known * rows.known.transpose() + mean / total;
  const Eigen::MatrixXd combinations = Eigen::MatrixXd::NullaryExpr(
      unit.rows(), 3,
      [&](Eigen::Index i, Eigen::Index c) { return std::cos(0.1 * static_cast<double>(i * (c + 1))); });
  const Eigen::MatrixXd expected = combinations.transpose() * dense * combinations;
  EXPECT_LT((model.covariance_of(combinations) - expected).norm(), 1e-9 * expected.norm());
}

TEST(Discrepancy, NeighboursTellTheNoiseWhateverIsMissed) {
  const ObservedRows rows = strip_rows(17, 60);
  std::mt19937 random(6);
  // Smooth along the sheet, ten times the noise.
  const Eigen::VectorXd y = kNoise * normal(random, rows.weights.size()) +
                            10 * kNoise * (20 * rows.places.col(0)).array().sin().matrix();
  // Neighbours are 3.4 mm apart: the smooth part differs by 10 sin(20 * 0.0034) = 0.7 of the noise at most,
  // half that in the mean square, and 1020 differences tell a median to 4 %.
  EXPECT_NEAR(noise_between_neighbours(rows, y), kNoise, 0.2 * kNoise);
  EXPECT_EQ(noise_between_neighbours(rows, y, 4), noise_between_neighbours(rows, y));
}

/// Mean and spread of a shift along `rate`, by quadrature over the likelihood.
std::pair<double, double> estimate(const ResidualLikelihood& likelihood, const Eigen::VectorXd& y,
                                   const Eigen::VectorXd& rate, double range) {
  constexpr int kPoints = 81;
  const Eigen::VectorXd grid = Eigen::VectorXd::LinSpaced(kPoints, -range, range);
  Eigen::VectorXd deviance(kPoints);
  for (int i = 0; i < kPoints; ++i) deviance[i] = likelihood.deviance(y - grid[i] * rate);
  const Eigen::VectorXd weights = (-0.5 * (deviance.array() - deviance.minCoeff())).exp();
  const double mean = weights.dot(grid) / weights.sum();
  return {mean, std::sqrt(weights.dot((grid.array() - mean).square().matrix()) / weights.sum())};
}

TEST(ResidualLikelihood, WithoutADiscrepancyTheIntervalIsThatOfTheNoise) {
  ObservedRows rows = strip_rows(17, 60);
  const Eigen::VectorXd rate = lifted(rows);
  rows.rates = rate;
  std::mt19937 random(2);
  double squares = 0, stated = 0;
  const double least = kNoise / rate.norm();  // Cramer and Rao
  constexpr int kDraws = 100;
  int found = 0;
  for (int draw = 0; draw < kDraws; ++draw) {
    const Eigen::VectorXd y = kNoise * normal(random, rate.size());
    const ResidualLikelihood likelihood(rows, y);
    EXPECT_NEAR(likelihood.misfit().noise, kNoise, 0.2 * kNoise);  // 5 sd: a median of 1020 differences
    const auto [mean, spread] = estimate(likelihood, y, rate, 0.03);
    squares += mean * mean / kDraws;
    stated += spread * spread / kDraws;
    found += likelihood.misfit().found;
  }
  EXPECT_NEAR(std::sqrt(squares), least, 0.3 * least);  // 4 sd, and 95 % efficiency
  // A discrepancy too small to be seen is still allowed for.
  EXPECT_GT(std::sqrt(stated), least);
  EXPECT_LT(std::sqrt(stated), 1.5 * least);
  EXPECT_LE(found, 12);  // 5 expected at one in twenty, 3.2 sd
}

TEST(ResidualLikelihood, IntervalsHoldTheTruthUnderADiscrepancy) {
  ObservedRows rows = strip_rows(17, 60);
  const Eigen::VectorXd rate = lifted(rows);
  rows.rates = rate;
  std::mt19937 random(3);
  const DiscrepancyModel any(rows, kNoise * normal(random, rate.size()));
  for (const std::size_t shape : {std::size_t{5}, std::size_t{10}}) {
    const Eigen::MatrixXd covariance =
        any.covariance(shape) + 1e-9 * Eigen::MatrixXd::Identity(rate.size(), rate.size());
    const Eigen::MatrixXd root = covariance.llt().matrixL();
    int held = 0, found = 0;
    constexpr int kDraws = 50;
    for (int draw = 0; draw < kDraws; ++draw) {
      const Eigen::VectorXd y =
          kNoise * normal(random, rate.size()) + 2e-3 * (root * normal(random, rate.size()));
      const ResidualLikelihood likelihood(rows, y);
      const auto [mean, spread] = estimate(likelihood, y, rate, 0.4);
      held += std::abs(mean) < 1.96 * spread;
      found += likelihood.misfit().found;
    }
    EXPECT_GE(held, 42) << shape;  // 47.5 expected, 3.6 sd
    EXPECT_EQ(found, kDraws);
  }
}

/// The same error of the model at every frame rate.
Eigen::VectorXd wrong(const ObservedRows& rows) {
  Eigen::VectorXd error(rows.weights.size());
  for (Eigen::Index i = 0; i < error.size(); ++i) {
    const double t = rows.times[static_cast<std::size_t>(rows.keyframe[static_cast<std::size_t>(i)])] / 0.8;
    error[i] = 3e-3 * std::sin(5 * t) * std::cos(4 * rows.places(i, 0) / 0.2);
  }
  return error;
}

TEST(ResidualLikelihood, MoreFramesOfTheSameErrorTellNoMore) {
  std::mt19937 random(4);
  std::vector<double> spreads, worth;
  for (const int keyframes : {9, 17, 33, 65}) {
    ObservedRows rows = strip_rows(keyframes, 60);
    const Eigen::VectorXd rate = lifted(rows);
    rows.rates = rate;
    const Eigen::VectorXd y = wrong(rows) + kNoise * normal(random, rate.size());
    const ResidualLikelihood likelihood(rows, y);
    spreads.push_back(estimate(likelihood, y, rate, 0.4).second);
    worth.push_back(likelihood.misfit().worth);
  }
  for (const double spread : spreads) EXPECT_GT(spread, 0.8 * spreads.front());
  // Independent keyframes would have given the 65 a third of it.
  EXPECT_LT(worth.back(), 20);
  EXPECT_LT(worth.back() / 65, worth.front() / 9);
}

// A likelihood with a smooth discrepancy in it finds what is rough; predictions ask for the least distance.
TEST(ResidualLikelihood, IsHighestWhereDistancesAreLeast) {
  ObservedRows rows = strip_rows(17, 60);
  const Eigen::VectorXd rate = lifted(rows);
  rows.rates = rate;
  std::mt19937 random(5);
  const Eigen::VectorXd y = 5 * wrong(rows) + kNoise * normal(random, rate.size());
  const ResidualLikelihood likelihood(rows, y);
  double least_distance = INFINITY, least_deviance = INFINITY, nearest = 0, likeliest = 0;
  for (double shift = -0.4; shift <= 0.4; shift += 0.002) {
    const Eigen::VectorXd residuals = y - shift * rate;
    if (const double distance = residuals.cwiseAbs().mean(); distance < least_distance) {
      least_distance = distance;
      nearest = shift;
    }
    if (const double deviance = likelihood.deviance(residuals); deviance < least_deviance) {
      least_deviance = deviance;
      likeliest = shift;
    }
  }
  // Huber's function turns into a distance at the noise, a tenth of what is missed here.
  EXPECT_NEAR((y - likeliest * rate).cwiseAbs().mean(), least_distance, 0.02 * least_distance);
  EXPECT_NEAR(likeliest, nearest, 0.05);
}

TEST(ResidualLikelihood, ParametersThatMoveNothingAreAllAsLikely) {
  ObservedRows rows = strip_rows(2, 10);
  std::mt19937 random(8);
  const Eigen::VectorXd y = kNoise * normal(random, rows.weights.size());
  rows.rates = Eigen::MatrixXd::Zero(y.size(), 2);
  const ResidualLikelihood likelihood(rows, y);
  EXPECT_TRUE(std::isfinite(likelihood.deviance(y)));
  EXPECT_GE(likelihood.spread(), likelihood.misfit().noise);
}

TEST(ResidualLikelihood, FreeErrorsCostNothingWithinTheirBoundsAndEndThere) {
  ObservedRows rows = strip_rows(9, 40);
  std::mt19937 random(7);
  const Eigen::VectorXd y = kNoise * normal(random, rows.weights.size());
  rows.free = Eigen::MatrixXd::Constant(y.size(), 1, 0.02);
  const ResidualLikelihood likelihood(rows, y);
  const double none = likelihood.deviance(y);
  EXPECT_NEAR(likelihood.deviance(y + 0.9 * rows.free.col(0)), none, 1e-3 * none);
  // Two noises beyond the bound: 1.345 (2 2 - 1.345) = 3.6 each row, where noise alone has less than 1.
  EXPECT_GT(likelihood.deviance(y + 1.1 * rows.free.col(0)), none + 2 * static_cast<double>(y.size()));
}

// At the root of a strip both rates and misfit vanish: the few rows that a misfit leaves below the limit are
// there, and tell nothing of how rho bends where the parameters move the rows.
TEST(ResidualLikelihood, TheSpreadOfRowsThatAMisfitTakesBeyondTheLimitIsNotThatOfTheFewBelow) {
  ObservedRows rows = strip_rows(9, 40);
  rows.rates = lifted(rows);
  const Eigen::Index count = rows.weights.size();
  std::mt19937 random(3);
  Eigen::VectorXd y = 1e-5 * normal(random, count);
  for (Eigen::Index i = 0; i < count; ++i)
    y[i] += 3e-2 * rows.places(i, 0) *
            std::cos(40 * rows.places(i, 0) + 0.5 * rows.keyframe[static_cast<std::size_t>(i)]);
  const double limit = 2e-5, size = std::sqrt(y.squaredNorm() / static_cast<double>(count));
  const ResidualLikelihood likelihood(rows, y, {}, limit);
  // Where all rows err together, the slope is n limit |rate| at most, and the bend, by the half of the rows
  // that is nearest, about n limit / size rate^2.
  EXPECT_LT(likelihood.spread(), 1.5 * std::sqrt(2 * static_cast<double>(count) * limit * size));
  EXPECT_GT(likelihood.spread(), likelihood.misfit().noise);
}

}  // namespace
}  // namespace flash::sysid
