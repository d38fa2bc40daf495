// The parts of a Newton iteration on the device, for many environments, beside the least time that their
// bytes and operations take. Usage: flash_cuda_bench [--floors] [VERTICES[,...] [ENVIRONMENTS[,...]]]
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <string>

#include "sim/cuda/batch_system.h"
#include "sim/cuda/devices.h"
#include "sim/cuda/layout/step_cost.h"
#include "tests/bench/device_bench.h"
#include "tests/bench/towel.h"

namespace flash::sim::cuda {
namespace {

struct Part {
  const char* name;
  PartCost cost;
  std::function<void(BatchSystem&)> run;

  double floor() const { return std::max(cost.bytes / bandwidth, cost.flops / single_rate); }
};

std::vector<Part> parts_of(const Towel& towel, FactorPrecision precision) {
  const FrontPlan fronts = plan_fronts(towel.plan->pattern, towel.plan->sheet.rest.vertices);
  const StepCost cost = step_cost(*towel.plan, fronts, lay_out(*towel.plan, towel.bending(), fronts),
                                  precision == FactorPrecision::half ? 2 : 4);
  return {
      {"energies and gradients", cost.evaluation, &BatchSystem::evaluate},
      {"matrix", cost.matrix, &BatchSystem::assemble_matrix},
      {"preconditioner", cost.preconditioner, &BatchSystem::assemble_preconditioner},
      {"factorization", cost.factorization, &BatchSystem::factorize},
      {"solve", cost.solve, &BatchSystem::solve},
      {"product", cost.product, &BatchSystem::multiply},
  };
}

double seconds_of(BatchSystem& batch, const Part& part) {
  using Clock = std::chrono::steady_clock;
  part.run(batch);
  batch.synchronize();
  double best = 1e9, spent = 0;
  for (int round = 0; round < 5 && spent < 0.5; ++round) {
    constexpr int repetitions = 5;
    const auto start = Clock::now();
    for (int k = 0; k < repetitions; ++k) part.run(batch);
    batch.synchronize();
    const double seconds = std::chrono::duration<double>(Clock::now() - start).count();
    best = std::min(best, seconds / repetitions);
    spent += seconds;
  }
  return best;
}

void time_parts(int vertices, int environments, FactorPrecision precision) {
  const Towel towel(vertices);
  const Membrane membrane =
      membrane_of(towel.material.constitutive,
                  sheet_lame(towel.material.membrane_stiffness, towel.material.poissons_ratio));
  std::vector<EnvironmentNumbers> numbers;
  for (int e = 0; e < environments; ++e) {
    const double scale = 0.5 + e / (environments + 1.0);
    numbers.push_back({membrane.law,
                       {scale * membrane.lame.mu, scale * membrane.lame.lambda},
                       scale * towel.material.bending_rigidity,
                       towel.material.areal_density / 1e-4});
  }
  BatchSystem batch(*towel.plan, towel.bending(), numbers, precision);
  for (int e = 0; e < environments; ++e) {
    batch.set_positions(e, towel.positions);
    batch.set_vector(
        e, data::Points::NullaryExpr(towel.positions.rows(), 3, [&](Eigen::Index i, Eigen::Index c) {
          return std::sin(0.7 * static_cast<double>(i) + static_cast<double>(c) + e);
        }));
  }
  const std::vector<Part> parts = parts_of(towel, precision);
  std::printf("\n%d vertices, %d environments, factor in %s precision\n",
              static_cast<int>(towel.positions.rows()), environments,
              precision == FactorPrecision::half ? "half" : "single");
  std::printf("%-24s %10s %12s %12s %8s %8s %8s\n", "part", "ms", "us an env.", "floor us", "ratio", "GB/s",
              "GFLOP/s");
  for (const Part& part : parts) {
    const double seconds = seconds_of(batch, part), each = seconds / environments;
    std::printf("%-24s %10.4f %12.3f %12.4f %8.1f %8.0f %8.0f\n", part.name, 1e3 * seconds, 1e6 * each,
                1e6 * part.floor(), each / part.floor(), part.cost.bytes / each * 1e-9,
                part.cost.flops / each * 1e-9);
  }
  const Part directions = {"directions", {}, [](BatchSystem& b) { b.find_directions(0); }};
  const double seconds = seconds_of(batch, directions);
  double solves = 0;
  for (const int count : batch.solves()) solves += count;
  solves /= environments;
  std::printf("%-24s %10.4f %12.3f   %.2f solves, %.3f us each with its product\n", directions.name,
              1e3 * seconds, 1e6 * seconds / environments, solves, 1e6 * seconds / environments / solves);
  std::fflush(stdout);
}

void print_floors(int vertices) {
  const Towel towel(vertices);
  const FrontPlan fronts = plan_fronts(towel.plan->pattern, towel.plan->sheet.rest.vertices);
  std::printf(
      "\n%d vertices: %zu fronts of %zu heights, %ld numbers in the factor, %.1f Mflop to factorize\n",
      static_cast<int>(towel.positions.rows()), fronts.fronts.size(), fronts.levels.size(),
      fronts.factor_entries, 1e-6 * fronts.factor_flops);
  std::printf("%-24s %10s %10s %12s %10s\n", "part, for an environment", "kB", "Mflop", "kB in half",
              "us (H200)");
  const std::vector<Part> parts = parts_of(towel, FactorPrecision::single),
                          half = parts_of(towel, FactorPrecision::half);
  for (std::size_t k = 0; k < parts.size(); ++k)
    std::printf("%-24s %10.0f %10.2f %12.0f %10.2f\n", parts[k].name, 1e-3 * parts[k].cost.bytes,
                1e-6 * parts[k].cost.flops, 1e-3 * half[k].cost.bytes, 1e6 * parts[k].floor());
}

}  // namespace
}  // namespace flash::sim::cuda

int main(int count, char** arguments) {
  using namespace flash::sim::cuda;
  const bool floors = count > 1 && std::string(arguments[1]) == "--floors";
  const int first = floors ? 2 : 1;
  const std::vector<int> vertices = numbers_of(count > first ? arguments[first] : "1024,2025,4096"),
                         environments =
                             numbers_of(count > first + 1 ? arguments[first + 1] : "1,8,64,256,1024");
  for (const int size : vertices) print_floors(size);
  if (floors) return 0;
  if (const std::string why = why_no_device(); !why.empty()) {
    std::fprintf(stderr, "flash_cuda_bench: %s\n", why.c_str());
    return 2;
  }
  for (const int size : vertices)
    for (const int batch : environments)
      for (const FactorPrecision precision : {FactorPrecision::single, FactorPrecision::half})
        time_parts(size, batch, precision);
}
