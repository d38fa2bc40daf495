// The parts of a solver step by themselves, on a towel in mid-air. Bytes a second are those the algorithm has
// to touch at least once.
#include <benchmark/benchmark.h>

#include <cmath>

#include "data/procedural_mesh.h"
#include "sim/elastic_energy.h"

namespace flash::sim {
namespace {

struct Towel {
  std::shared_ptr<const SheetPlan> plan;
  data::SheetMaterial material;
  data::Points positions;
  BlockValues<double> values;

  explicit Towel(int vertices) {
    data::RectangleMesh rectangle;
    rectangle.width = rectangle.height = 0.4;
    rectangle.cells_x = rectangle.cells_y = static_cast<int>(std::lround(std::sqrt(vertices))) - 1;
    plan = make_sheet_plan(make_sheet(data::rectangle(rectangle)));
    material.areal_density = 0.2;
    material.bending_rigidity = 3e-5;
    positions = plan->sheet.rest.vertices;
    for (int i = 0; i < positions.rows(); ++i)
      positions(i, 2) = 0.02 * std::sin(15 * positions(i, 0)) * std::cos(11 * positions(i, 1));
    assemble(Curvature::positive);
  }

  const BendingOperator& bending() const {
    return bending_operator(*plan, material.bending_model, material.poissons_ratio);
  }

  void assemble(Curvature curvature) {
    const double time_step = 0.01;
    values.assign(9 * (plan->pattern.size + plan->pattern.pairs.size()), 0.0);
    add_elastic_hessian(*plan, bending(), material, positions, 1.0, curvature, values);
    add_bending_stand_in(bending(), material.bending_rigidity, values);
    for (int i = 0; i < plan->pattern.size; ++i)
      for (int c = 0; c < 3; ++c)
        values[9L * i + 4 * c] +=
            material.areal_density * plan->sheet.vertex_area[i] / (time_step * time_step);
  }
};

void energy_and_forces(benchmark::State& state) {
  const Towel towel(static_cast<int>(state.range(0)));
  data::Points force = data::Points::Zero(towel.positions.rows(), 3);
  for (auto _ : state)
    benchmark::DoNotOptimize(
        add_elastic_gradient(*towel.plan, towel.bending(), towel.material, towel.positions, force));
  state.SetItemsProcessed(state.iterations() * static_cast<long>(towel.plan->sheet.triangles.size()));
}

void matrix(benchmark::State& state) {
  Towel towel(static_cast<int>(state.range(0)));
  for (auto _ : state) towel.assemble(Curvature::exact);
  state.SetItemsProcessed(state.iterations() * static_cast<long>(towel.plan->sheet.triangles.size()));
}

void factorization(benchmark::State& state) {
  const Towel towel(static_cast<int>(state.range(0)));
  BlockCholesky<float> factor(towel.plan->symbolic);
  for (auto _ : state)
    if (!factor.factorize(towel.values)) state.SkipWithError("not positive definite");
}

void triangular_solves(benchmark::State& state) {
  const Towel towel(static_cast<int>(state.range(0)));
  BlockCholesky<float> factor(towel.plan->symbolic);
  if (!factor.factorize(towel.values)) state.SkipWithError("not positive definite");
  Eigen::VectorXf x = Eigen::VectorXf::Ones(towel.positions.size());
  for (auto _ : state) {
    x.setOnes();
    factor.solve_in_order(x.data());
  }
  state.SetBytesProcessed(state.iterations() * 2 * 4 * factor_entries(*towel.plan->symbolic));
}

void matrix_product(benchmark::State& state) {
  const Towel towel(static_cast<int>(state.range(0)));
  SheetProduct<float> product;
  product.assign(towel.plan->triangle_product, towel.values, towel.bending().elimination_stiffness,
                 towel.material.bending_rigidity);
  Eigen::VectorXf x = Eigen::VectorXf::Ones(towel.positions.size()), y = x;
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
