#include "sysid/infer/discrepancy.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <random>

namespace flash::sysid {
namespace {

constexpr double kNoise = 1e-3;  // [m]

/// A strip of 20 cm seen at `keyframes` times within 0.8 s, `points` at each.
ObservedRows strip_rows(int keyframes, int points) {
  ObservedRows rows;
  const int count = keyframes * points;
  rows.places.resize(count, 2);
  rows.weights = Eigen::VectorXd::Ones(count);
  for (int k = 0; k < keyframes; ++k) rows.times.push_back(0.8 * k / (keyframes - 1));
  for (int i = 0; i < count; ++i) {
    rows.keyframe.push_back(i / points);
    rows.channel.push_back(0);
    const double along = (i % points + 0.5) / points;
    rows.places.row(i) << 0.2 * along, 0.025 * ((7 * i) % points) / (points - 1);
  }
  return rows;
}

/// How the rows of a strip would move with a parameter: later and farther out, more.
Eigen::VectorXd lifted(const ObservedRows& rows) {
  Eigen::VectorXd rate(rows.weights.size());
  for (Eigen::Index i = 0; i < rate.size(); ++i) {
    const double t = rows.times[static_cast<std::size_t>(rows.keyframe[static_cast<std::size_t>(i)])] / 0.8;
    rate[i] = 0.05 * t * t * std::pow(rows.places(i, 0) / 0.2, 2);
  }
  return rate;
}

Eigen::VectorXd normal(std::mt19937& random, Eigen::Index count) {
  std::normal_distribution<double> draw;
  return Eigen::VectorXd::NullaryExpr(count, [&](Eigen::Index) { return draw(random); });
}

TEST(Discrepancy, LikelihoodIsThatOfTheDenseCovariance) {
  ObservedRows rows = strip_rows(7, 20);
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

/// Half of the 95 % interval of a shift along `rate`, by quadrature over the likelihood.
std::pair<double, double> estimate(const DiscrepancyModel& model, const Eigen::VectorXd& y,
                                   const Eigen::VectorXd& rate) {
  constexpr int kPoints = 401;
  const Eigen::VectorXd grid = Eigen::VectorXd::LinSpaced(kPoints, -0.4, 0.4);
  const Eigen::VectorXd deviance = model.deviance(y.replicate(1, kPoints) - rate * grid.transpose());
  const Eigen::VectorXd weights = (-0.5 * (deviance.array() - deviance.minCoeff())).exp();
  const double mean = weights.dot(grid) / weights.sum();
  return {mean, std::sqrt(weights.dot((grid.array() - mean).square().matrix()) / weights.sum())};
}

TEST(Discrepancy, WithoutOneTheIntervalIsThatOfTheNoise) {
  const ObservedRows rows = strip_rows(17, 60);
  const Eigen::VectorXd rate = lifted(rows);
  std::mt19937 random(2);
  double squares = 0, stated = 0;
  const double least = kNoise / rate.norm();  // Cramer and Rao
  constexpr int kDraws = 100;
  int found = 0;
  for (int draw = 0; draw < kDraws; ++draw) {
    const Eigen::VectorXd y = kNoise * normal(random, rate.size());
    const DiscrepancyModel model(rows, y);
    EXPECT_NEAR(model.noise(), kNoise, 0.1 * kNoise);  // 4.5 sd at 1000 degrees of freedom
    const auto [mean, spread] = estimate(model, y, rate);
    squares += mean * mean / kDraws;
    stated += spread * spread / kDraws;
    found += model.describe(y, rate).found;
  }
  EXPECT_NEAR(std::sqrt(squares), least, 0.3 * least);  // 4 sd, and some efficiency
  // A discrepancy too small to be seen is still allowed for.
  EXPECT_GT(std::sqrt(stated), least);
  EXPECT_LT(std::sqrt(stated), 2 * least);
  EXPECT_LE(found, 12);  // 5 expected at one in twenty, 3.2 sd
}

TEST(Discrepancy, IntervalsHoldTheTruthUnderOne) {
  const ObservedRows rows = strip_rows(17, 60);
  const Eigen::VectorXd rate = lifted(rows);
  std::mt19937 random(3);
  const Eigen::VectorXd some = kNoise * normal(random, rate.size());
  const DiscrepancyModel any(rows, some);
  for (const std::size_t shape : {std::size_t{4}, std::size_t{7}}) {
    const Eigen::MatrixXd covariance =
        any.covariance(shape) + 1e-9 * Eigen::MatrixXd::Identity(rate.size(), rate.size());
    const Eigen::MatrixXd root = covariance.llt().matrixL();
    int held = 0, found = 0;
    constexpr int kDraws = 50;
    for (int draw = 0; draw < kDraws; ++draw) {
      const Eigen::VectorXd y =
          kNoise * normal(random, rate.size()) + 2e-3 * (root * normal(random, rate.size()));
      const DiscrepancyModel model(rows, y);
      const auto [mean, spread] = estimate(model, y, rate);
      held += std::abs(mean) < 1.96 * spread;
      found += model.describe(y, rate).found;
    }
    EXPECT_GE(held, 42);  // 47.5 expected, 3.6 sd
    EXPECT_EQ(found, kDraws);
  }
}

TEST(Discrepancy, MoreFramesOfTheSameErrorTellNoMore) {
  const auto error = [](const ObservedRows& rows) {
    Eigen::VectorXd wrong(rows.weights.size());
    for (Eigen::Index i = 0; i < wrong.size(); ++i) {
      const double t = rows.times[static_cast<std::size_t>(rows.keyframe[static_cast<std::size_t>(i)])] / 0.8;
      wrong[i] = 3e-3 * std::sin(5 * t) * std::cos(4 * rows.places(i, 0) / 0.2);
    }
    return wrong;
  };
  std::mt19937 random(4);
  std::vector<double> spreads, worth;
  for (const int keyframes : {9, 17, 33, 65}) {
    const ObservedRows rows = strip_rows(keyframes, 60);
    const Eigen::VectorXd rate = lifted(rows);
    const Eigen::VectorXd y = error(rows) + kNoise * normal(random, rate.size());
    const DiscrepancyModel model(rows, y);
    spreads.push_back(estimate(model, y, rate).second);
    worth.push_back(model.describe(y, rate).worth);
  }
  for (const double spread : spreads) EXPECT_GT(spread, 0.8 * spreads.front());
  // Independent keyframes would have given the 65 a third of it.
  EXPECT_LT(worth.back(), 20);
  EXPECT_LT(worth.back() / 65, worth.front() / 9);
}

}  // namespace
}  // namespace flash::sysid
