#include "sim/cpu/block_cholesky.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cstdlib>
#include <limits>
#include <numeric>
#include <random>
#include <set>

#include "tests/sim/cpu/solve_in_place.h"

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

/// Bound on |b - A x| by entries, where x comes from a Cholesky factorization in precision `epsilon`: Higham
/// 2002, "Accuracy and stability of numerical algorithms", theorem 10.4, with (|L| |L|^T)_ij <= sqrt(a_ii
/// a_jj) in any order of elimination. Inverses of the diagonal blocks of L, of condition below 3 here, stand
/// for substitution: 9 for their square. What is stored of L is rounded once more, by `stored`: 2 for L and
/// L^T, 3 for the inverse in it.
VectorXd residual_bound(const MatrixXd& A, const VectorXd& x, double epsilon, double stored) {
  const double n = static_cast<double>(A.rows());
  const VectorXd root = A.diagonal().cwiseSqrt();
  return (9 * (3 * n + 1) * epsilon + 2 * 3 * stored) * root.dot(x.cwiseAbs()) * root;
}

template <typename Scalar>
void expect_solved(const Kernels& kernels, const Example& example, double stored) {
  const auto symbolic = analyze(example.pattern);
  BlockCholesky<Scalar> factor(symbolic, kernels);
  ASSERT_TRUE(factor.factorize(example.values));
  const VectorXd right = VectorXd::LinSpaced(example.dense.rows(), -1, 2);
  VectorXd x = right;
  solve_in_place(factor, symbolic->position, x.data());
  const VectorXd bound = residual_bound(example.dense, x, std::numeric_limits<Scalar>::epsilon(), stored);
  // In double precision the residual's own rounding counts too: n epsilon |A| |x|, below the bound.
  EXPECT_TRUE(((right - example.dense * x).array().abs() <= bound.array()).all()) << example.pattern.size;
}

TEST(BlockCholesky, SolvesToItsRoundingAtEveryLevel) {
  for (const InstructionLevel level : instruction_levels()) {
    SCOPED_TRACE(to_string(level));
    for (const auto& [size, pairs] : {std::pair{1, 0}, {2, 1}, {7, 0}, {40, 60}, {90, 200}}) {
      const Example example = random_example(size, pairs, 3 * size + 1);
      expect_solved<double>(kernels_of(level), example, 0);
      expect_solved<float>(kernels_of(level), example, 0x1p-11);  // half precision
    }
  }
}

TEST(BlockCholesky, FactorizingAgainForgetsTheFirstMatrix) {
  Example example = random_example(50, 120, 9);
  const auto symbolic = analyze(example.pattern);
  BlockCholesky<double> factor(symbolic, kernels_of(highest_instruction_level()));
  ASSERT_TRUE(factor.factorize(example.values));
  for (double& value : example.values) value *= 2;
  ASSERT_TRUE(factor.factorize(example.values));
  VectorXd x = VectorXd::Ones(150);
  const VectorXd expected = (2 * example.dense).llt().solve(x);
  solve_in_place(factor, symbolic->position, x.data());
  EXPECT_LT((x - expected).norm(), 1e-13 * expected.norm());  // condition below 10, rounding 1e-16
}

TEST(BlockCholesky, AnIndefiniteMatrixIsRefused) {
  Example example = random_example(20, 30, 2);
  example.values[9 * 7 + 4] = -60;
  for (const InstructionLevel level : instruction_levels()) {
    BlockCholesky<double> factor(analyze(example.pattern), kernels_of(level));
    EXPECT_FALSE(factor.factorize(example.values));
  }
}

// Any other part of a program may draw from the C library's generator.
TEST(BlockCholesky, TheOrderDependsOnThePatternAlone) {
  const Example example = random_example(90, 200, 5);
  std::srand(1);
  const std::vector<int> position = analyze(example.pattern)->position;
  std::srand(2);
  EXPECT_EQ(analyze(example.pattern)->position, position);
  std::vector<int> sorted = position;
  std::sort(sorted.begin(), sorted.end());
  std::vector<int> all(90);
  std::iota(all.begin(), all.end(), 0);
  EXPECT_EQ(sorted, all);
}

}  // namespace
}  // namespace flash::sim
