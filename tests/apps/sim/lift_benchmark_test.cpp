#include "apps/sim/lift_benchmark.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

#include "tests/data/temporary_folder.h"

namespace flash::sim {
namespace {

/// What a step takes, by name.
nlohmann::ordered_json counts_of(const LiftBenchmarkResult& result) {
  const auto calls = [&](const std::string& name) {
    return std::ranges::find(result.phases, name, &BenchmarkPhase::name)->calls_per_step;
  };
  return {{"iterations", result.iterations},
          {"solves", calls("triangular solves")},
          {"factorizations", calls("factorization")}};
}

// Counts, not times: at the lowest level of the kernels, which every machine has, they are the same wherever
// the compiler rounds alike. A last digit that differs grows as the sheet folds: densities that differ by
// 1e-12 spread the counts over up to 5 %, and so do the levels.
TEST(LiftBenchmark, TakesTheIterationsOfItsBaseline) {
  constexpr double tolerance = 0.06;
  const LiftBenchmarkResult result = run_lift_benchmark({.vertices = 250,
                                                         .environments = 24,
                                                         .steps = 120,
                                                         .threads = 2,
                                                         .level = instruction_levels().front()},
                                                        false);
  EXPECT_GE(result.converged_share, 0.999);  // all where it was measured
  const nlohmann::ordered_json found = counts_of(result);
  std::ifstream in(FLASH_LIFT_COUNTS);
  const nlohmann::json expected = nlohmann::json::parse(in);
  for (const auto& [name, count] : found.items()) {
    const double wanted = expected.value(name, 0.0);
    EXPECT_NEAR(count.get<double>(), wanted, tolerance * wanted) << name << " a step";
  }
  if (HasFailure())
    ADD_FAILURE()
        << "If this change is meant to change the counts, renew tests/apps/sim/lift_counts.json with\n"
        << found.dump(2);
}

TEST(LiftBenchmark, EnvironmentsAloneTakeTheIterationsOfThoseTogether) {
  LiftBenchmark benchmark = {.vertices = 100, .environments = 3, .steps = 20, .threads = 2};
  const LiftBenchmarkResult together = run_lift_benchmark(benchmark, false);
  benchmark.alone = true;
  const LiftBenchmarkResult alone = run_lift_benchmark(benchmark, false);
  EXPECT_EQ(counts_of(alone), counts_of(together));
  EXPECT_EQ(alone.iterations_max, together.iterations_max);
  EXPECT_EQ(alone.residual_max, together.residual_max);
  EXPECT_DOUBLE_EQ(alone.step_milliseconds,
                   1e3 * alone.wall_seconds / (benchmark.environments * benchmark.steps));
}

// Before anything is made, and wherever there is no device.
TEST(LiftBenchmark, MoreVerticesThanADeviceTakesAreRefused) {
  const auto refusal = [](int vertices, Device device) {
    return data::input_error_of([&] { check({.vertices = vertices, .device = device}); });
  };
  EXPECT_EQ(refusal(1'000'000, Device::cuda),
            "--vertices: found 1,000,000, expected at most 65,536 on a CUDA device; use --device cpu");
  EXPECT_EQ(refusal(65'800, Device::cuda),  // the next square number
            "--vertices: found 66,049, expected at most 65,536 on a CUDA device; use --device cpu");
  EXPECT_EQ(refusal(65'600, Device::cuda), "");
  EXPECT_EQ(refusal(65'800, Device::cpu), "");
}

TEST(LiftBenchmark, SizesBeyondTheMemoryAreRefused) {
  const auto refusal = [](int vertices, int environments, int steps, double limit = 25e9) {
    return data::input_error_of([&] {
      check({.vertices = vertices, .environments = environments, .steps = steps, .threads = 2}, limit);
    });
  };
  // 2 * 14 kB for solvers, 1,024 * 450 B for what is kept
  EXPECT_EQ(
      refusal(1'000'000, 1'000'000, 1),
      "--vertices: 1,000,000 of 1,024 environments at once on 2 threads take about 488,800 MB of memory, "
      "expected at most the 25,000 MB that there are");
  // 1,024 * 64 B a step
  EXPECT_EQ(refusal(1000, 1'000'000, 1'000'000),
            "--steps: 1,000,000 of 1,024 environments at once on 2 threads take about 66,036 MB of memory, "
            "expected at most the 25,000 MB that there are");
  EXPECT_EQ(refusal(1'000'000, 1, 1), "");
  EXPECT_EQ(refusal(1000, 100'000, 250), "");
  EXPECT_EQ(refusal(1'000'000, 1'000'000, 1, 2e12).find("MB"), std::string::npos);
}

// 1,024 vertices by 250 steps by a million on two threads, a million of these a second on each.
TEST(LiftBenchmark, DaysOfWorkAreRefused) {
  LiftBenchmark benchmark = {.vertices = 1000, .environments = 1'000'000, .steps = 250, .threads = 2};
  EXPECT_DOUBLE_EQ(least_seconds(benchmark), 128000);
  EXPECT_EQ(data::input_error_of([&] { check(benchmark, 0); }),
            "--envs: 1,000,000 environments of 250 steps of 1,024 vertices take more than 1.481 days on the "
            "CPU, expected at most one: use fewer");
  benchmark.environments = 100'000;
  EXPECT_EQ(data::input_error_of([&] { check(benchmark, 0); }), "");
  benchmark.environments = 1'000'000;
  benchmark.device = Device::cuda;
  EXPECT_EQ(data::input_error_of([&] { check(benchmark, 0); }), "");
}

}  // namespace
}  // namespace flash::sim
