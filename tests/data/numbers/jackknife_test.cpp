#include "data/numbers/jackknife.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <random>

namespace flash::data {
namespace {

// Of the mean of groups it is the mean square between groups of the analysis of variance, over the variance.
TEST(Jackknife, OfAMeanIsTheMeanSquareBetweenGroups) {
  constexpr int kGroups = 5, kOwn = 4;
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  Eigen::MatrixXd numbers(kOwn, kGroups);
  for (int i = 0; i < kOwn * kGroups; ++i) numbers(i % kOwn, i / kOwn) = normal(random);
  const double mean = numbers.mean();
  const Eigen::RowVectorXd means = numbers.colwise().mean();
  const double between = kOwn * (means.array() - mean).square().sum() / (kGroups - 1);
  std::vector<GroupTerms> groups;
  for (int i = 0; i < kGroups; ++i)
    groups.push_back(
        {Eigen::MatrixXd::Constant(1, 1, kOwn), Eigen::VectorXd::Constant(1, kOwn * (mean - means[i]))});
  const Eigen::MatrixXd all = Eigen::MatrixXd::Constant(1, 1, kOwn * kGroups);
  EXPECT_NEAR(jackknife_factor(groups, all, all), between, 1e-12);
}

/// Of a fit of three unknowns to five groups of two numbers, of noise 1 and `shared` by a group.
double factor_of_fit(double shared, std::mt19937& random) {
  std::normal_distribution<double> normal;
  std::vector<Eigen::MatrixXd> rows(5, Eigen::MatrixXd(2, 3));
  std::vector<Eigen::Vector2d> seen(5);
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(3, 3);
  Eigen::VectorXd pull = Eigen::VectorXd::Zero(3);
  for (std::size_t g = 0; g < rows.size(); ++g) {
    for (int i = 0; i < 6; ++i) rows[g](i / 3, i % 3) = normal(random);
    const double common = shared * normal(random);
    seen[g] = Eigen::Vector2d(common + normal(random), common + normal(random));
    information += rows[g].transpose() * rows[g];
    pull += rows[g].transpose() * seen[g];
  }
  const Eigen::VectorXd fitted = information.ldlt().solve(pull);
  std::vector<GroupTerms> groups;
  for (std::size_t g = 0; g < rows.size(); ++g)
    groups.push_back({rows[g].transpose() * rows[g], rows[g].transpose() * (rows[g] * fitted - seen[g])});
  return jackknife_factor(groups, information, information);
}

TEST(Jackknife, IsOneInTheMeanHoweverMuchAGroupWeighsAndMoreWhereGroupsErrTogether) {
  constexpr int kTrials = 4000;
  std::mt19937 random(2);
  double alone = 0, together = 0, squares = 0;
  for (int i = 0; i < kTrials; ++i) {
    const double factor = factor_of_fit(0, random);
    alone += factor / kTrials;
    squares += factor * factor / kTrials;
    together += factor_of_fit(1, random) / kTrials;
  }
  EXPECT_NEAR(alone, 1, 4 * std::sqrt((squares - alone * alone) / kTrials));
  // Half of the variance of two rows is shared: up to a factor of three where both pull one way.
  EXPECT_GT(together, 1.5);
  EXPECT_LT(together, 3);
}

TEST(Jackknife, IsOneWhereSomeGroupIsNeeded) {
  std::vector<GroupTerms> groups(2, {Eigen::MatrixXd::Zero(2, 2), Eigen::Vector2d(1, 1)});
  groups[0].information(0, 0) = groups[1].information(1, 1) = 1;
  const Eigen::MatrixXd all = Eigen::MatrixXd::Identity(2, 2);
  EXPECT_EQ(jackknife_factor(groups, all, all), 1);
}

}  // namespace
}  // namespace flash::data
