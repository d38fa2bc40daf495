// The factorization and its solves against other libraries', on the same matrix in double precision; theirs
// order by themselves, minimum degree too.
#include <benchmark/benchmark.h>

#include <Eigen/SparseCholesky>
#ifdef FLASH_CHOLMOD
#include <Eigen/CholmodSupport>
#endif

#include "tests/bench/towel.h"

namespace flash::sim {
namespace {

using Matrix = Eigen::SparseMatrix<double>;

Matrix sparse_matrix(const Towel& towel) {
  const BlockPattern& pattern = towel.plan->pattern;
  std::vector<Eigen::Triplet<double>> entries;
  const auto add = [&](int row, int column, std::size_t block) {
    for (int c = 0; c < 3; ++c)
      for (int r = 0; r < 3; ++r) {
        const double value = towel.values[9 * block + 3 * c + r];
        entries.emplace_back(3 * row + r, 3 * column + c, value);
        if (row != column) entries.emplace_back(3 * column + c, 3 * row + r, value);
      }
  };
  for (int i = 0; i < pattern.size; ++i) add(i, i, i);
  for (std::size_t k = 0; k < pattern.pairs.size(); ++k)
    add(pattern.pairs[k].first, pattern.pairs[k].second, pattern.size + k);
  Matrix matrix(3L * pattern.size, 3L * pattern.size);
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

template <typename Scalar>
void flash_factorize(benchmark::State& state) {
  const Towel towel(static_cast<int>(state.range(0)));
  BlockCholesky<Scalar> factor(towel.plan->symbolic, *towel.plan->kernels);
  for (auto _ : state)
    if (!factor.factorize(towel.values)) state.SkipWithError("not positive definite");
}

template <typename Scalar>
void flash_solve(benchmark::State& state) {
  const Towel towel(static_cast<int>(state.range(0)));
  BlockCholesky<Scalar> factor(towel.plan->symbolic, *towel.plan->kernels);
  if (!factor.factorize(towel.values)) state.SkipWithError("not positive definite");
  Eigen::Matrix<Scalar, Eigen::Dynamic, 1> x(4 * towel.positions.rows());
  for (auto _ : state) {
    x.setOnes();
    factor.solve_in_order(x.data());
  }
}

template <typename Solver>
void other_factorize(benchmark::State& state) {
  const Matrix matrix = sparse_matrix(Towel(static_cast<int>(state.range(0))));
  Solver solver;
  solver.analyzePattern(matrix);
  for (auto _ : state) {
    solver.factorize(matrix);
    if (solver.info() != Eigen::Success) state.SkipWithError("not positive definite");
  }
}

template <typename Solver>
void other_solve(benchmark::State& state) {
  const Matrix matrix = sparse_matrix(Towel(static_cast<int>(state.range(0))));
  const Solver solver(matrix);
  const Eigen::VectorXd right = Eigen::VectorXd::Ones(matrix.rows());
  Eigen::VectorXd x(matrix.rows());
  for (auto _ : state) {
    x = solver.solve(right);
    benchmark::DoNotOptimize(x.data());
  }
}

void sizes(benchmark::internal::Benchmark* benchmark) {
  benchmark->Arg(1024)->Arg(2025)->Arg(4096)->Unit(benchmark::kMillisecond);
}

BENCHMARK_TEMPLATE(flash_factorize, float)->Apply(sizes);
BENCHMARK_TEMPLATE(flash_factorize, double)->Apply(sizes);
BENCHMARK_TEMPLATE(other_factorize, Eigen::SimplicialLLT<Matrix>)->Apply(sizes);
#ifdef FLASH_CHOLMOD
BENCHMARK_TEMPLATE(other_factorize, Eigen::CholmodSupernodalLLT<Matrix>)->Apply(sizes);
#endif
BENCHMARK_TEMPLATE(flash_solve, float)->Apply(sizes);
BENCHMARK_TEMPLATE(flash_solve, double)->Apply(sizes);
BENCHMARK_TEMPLATE(other_solve, Eigen::SimplicialLLT<Matrix>)->Apply(sizes);
#ifdef FLASH_CHOLMOD
BENCHMARK_TEMPLATE(other_solve, Eigen::CholmodSupernodalLLT<Matrix>)->Apply(sizes);
#endif

}  // namespace
}  // namespace flash::sim
