#include "sim/block_cholesky.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <random>
#include <set>

namespace flash::sim {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

struct Example {
  BlockPattern pattern;
  BlockValues<double> values;
  MatrixXd dense;
};

/// Random sparse graph with a diagonal that makes it positive definite.
Example random_example(int size, int pairs, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> entry(-1, 1);
  std::uniform_int_distribution<int> vertex(0, size - 1);
  Example example{{size, {}}, {}, MatrixXd::Zero(3 * size, 3 * size)};
  std::set<std::pair<int, int>> seen;
  while (static_cast<int>(seen.size()) < pairs) {
    const int i = vertex(random), j = vertex(random);
    if (i != j && seen.insert(std::minmax(i, j)).second) example.pattern.pairs.push_back({i, j});
  }
  const auto put = [&](int i, int j, const Eigen::Matrix3d& block) {
    for (int k = 0; k < 9; ++k) example.values.push_back(block(k % 3, k / 3));
    example.dense.block<3, 3>(3 * i, 3 * j) = block;
    example.dense.block<3, 3>(3 * j, 3 * i) = block.transpose();
  };
  for (int i = 0; i < size; ++i) {
    Eigen::Matrix3d block = Eigen::Matrix3d::NullaryExpr([&] { return entry(random); });
    put(i, i, block + block.transpose() + 60 * Eigen::Matrix3d::Identity());
  }
  for (const auto& [i, j] : example.pattern.pairs)
    put(i, j, Eigen::Matrix3d::NullaryExpr([&] { return entry(random); }));
  return example;
}

TEST(BlockCholesky, SolvesLikeADenseFactorization) {
  for (const auto& [size, pairs] : {std::pair{1, 0}, {2, 1}, {7, 0}, {40, 60}, {90, 200}}) {
    const Example example = random_example(size, pairs, 3 * size + 1);
    BlockCholesky<double> factor(analyze(example.pattern));
    ASSERT_TRUE(factor.factorize(example.values));
    VectorXd x = VectorXd::LinSpaced(3 * size, -1, 2);
    const VectorXd expected = example.dense.llt().solve(x);
    factor.solve_in_place(x.data());
    EXPECT_LT((x - expected).norm(), 1e-13 * expected.norm()) << size;  // condition below 10, rounding 1e-16
  }
}

TEST(BlockCholesky, SinglePrecisionSolvesToItsRounding) {
  const Example example = random_example(90, 200, 5);
  BlockCholesky<float> factor(analyze(example.pattern));
  ASSERT_TRUE(factor.factorize(example.values));
  const VectorXd right = VectorXd::LinSpaced(270, -1, 2);
  VectorXd x = right;
  factor.solve_in_place(x.data());
  const VectorXd expected = example.dense.llt().solve(right);
  EXPECT_LT((x - expected).norm(), 1e-5 * expected.norm());
}

TEST(BlockCholesky, FactorizingAgainForgetsTheFirstMatrix) {
  Example example = random_example(50, 120, 9);
  BlockCholesky<double> factor(analyze(example.pattern));
  ASSERT_TRUE(factor.factorize(example.values));
  for (double& value : example.values) value *= 2;
  ASSERT_TRUE(factor.factorize(example.values));
  VectorXd x = VectorXd::Ones(150);
  const VectorXd expected = (2 * example.dense).llt().solve(x);
  factor.solve_in_place(x.data());
  EXPECT_LT((x - expected).norm(), 1e-13 * expected.norm());
}

TEST(BlockCholesky, AnIndefiniteMatrixIsRefused) {
  Example example = random_example(20, 30, 2);
  example.values[9 * 7 + 4] = -60;
  BlockCholesky<double> factor(analyze(example.pattern));
  EXPECT_FALSE(factor.factorize(example.values));
}

}  // namespace
}  // namespace flash::sim
