// The parts of a solver step by themselves, on a towel in mid-air. Bytes a second are those the algorithm has
// to touch at least once.
#include <benchmark/benchmark.h>

#include "tests/bench/towel.h"

namespace flash::sim {
namespace {

void energy_and_forces(benchmark::State& state) {
  const Towel towel(static_cast<int>(state.range(0)));
  data::Points force = data::Points::Zero(towel.positions.rows(), 3);
  for (auto _ : state)
    benchmark::DoNotOptimize(add_elastic_gradient(*towel.plan, towel.law(), towel.positions, force));
  state.SetItemsProcessed(state.iterations() * static_cast<long>(towel.plan->sheet.triangles.size()));
}

void matrix(benchmark::State& state) {
  Towel towel(static_cast<int>(state.range(0)));
  for (auto _ : state) towel.assemble(Curvature::exact);
  state.SetItemsProcessed(state.iterations() * static_cast<long>(towel.plan->sheet.triangles.size()));
}

void factorization(benchmark::State& state) {
  const Towel towel(static_cast<int>(state.range(0)));
  BlockCholesky<float> factor(towel.plan->symbolic, *towel.plan->kernels);
  for (auto _ : state)
    if (!factor.factorize(towel.values)) state.SkipWithError("not positive definite");
}

void triangular_solves(benchmark::State& state) {
  const Towel towel(static_cast<int>(state.range(0)));
  BlockCholesky<float> factor(towel.plan->symbolic, *towel.plan->kernels);
  if (!factor.factorize(towel.values)) state.SkipWithError("not positive definite");
  Eigen::VectorXf x(4 * towel.positions.rows());
  for (auto _ : state) {
    x.setOnes();
    factor.solve_in_order(x.data());
  }
  state.SetBytesProcessed(state.iterations() * 2 * 4 * towel.plan->symbolic->entries);
}

void matrix_product(benchmark::State& state) {
  const Towel towel(static_cast<int>(state.range(0)));
  SheetProduct<float> product(*towel.plan->kernels);
  product.assign(towel.plan->triangle_product, towel.values,
                 {{&towel.bending().elimination_stiffness, towel.material.bending_rigidity}});
  Eigen::VectorXf x = Eigen::VectorXf::Ones(4 * towel.positions.rows()), y = x;
  for (auto _ : state) product.multiply(x.data(), y.data());
  const size_t blocks = towel.plan->triangle_product.sources.size(),
               columns = towel.bending().elimination_stiffness.columns.size();
  state.SetBytesProcessed(state.iterations() * static_cast<long>(52 * blocks + 20 * columns));
}

BENCHMARK(energy_and_forces)->Arg(1024)->Arg(4096)->Unit(benchmark::kMicrosecond);
BENCHMARK(matrix)->Arg(1024)->Arg(4096)->Unit(benchmark::kMicrosecond);
BENCHMARK(factorization)->Arg(1024)->Arg(4096)->Unit(benchmark::kMicrosecond);
BENCHMARK(triangular_solves)->Arg(1024)->Arg(4096)->Unit(benchmark::kMicrosecond);
BENCHMARK(matrix_product)->Arg(1024)->Arg(4096)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace flash::sim
