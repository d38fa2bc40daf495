// Whole steps on the device: sheets carried by a corner, each of its own material. Usage:
// flash_cuda_replay_bench [VERTICES[,...] [ENVIRONMENTS[,...] [STEPS [SOLVES_BY_AN_OLD_FACTOR [table|air
// [BLOCKS[,...]]]]]]] They hang free, or lie on a table with friction of 0.3. BLOCKS: processors that work on
// an environment, 0 for as many as there are.
#include <chrono>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <random>
#include <string>

#include "sim/cuda/batch_system.h"
#include "sim/cuda/devices.h"
#include "sim/cuda/layout/step_cost.h"
#include "tests/bench/corner_lift.h"
#include "tests/bench/device_bench.h"
#include "tests/bench/towel.h"

namespace flash::sim::cuda {
namespace {

/// E t from 10 to 300 N/m and D from 1e-5 to 1e-4 N m, drawn evenly in their logarithms.
std::vector<ReplayEnvironment> lifts(const Towel& towel, int count, int steps, double time_step, bool table) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> share(0, 1);
  const data::Points& rest = towel.plan->sheet.rest.vertices;
  const auto motion = corner_lift(rest, steps, time_step);
  std::vector<ReplayEnvironment> environments;
  for (int e = 0; e < count; ++e) {
    ReplayEnvironment environment;
    environment.material = towel.material;
    environment.material.membrane_stiffness = 10 * std::pow(30, share(random));
    environment.material.bending_rigidity = 1e-5 * std::pow(10, share(random));
    environment.material.friction = 0.3;
    if (table) environment.obstacles = {{Plane{}}};
    environment.holds = motion;
    environment.positions = rest;
    environment.velocities = data::Points::Zero(rest.rows(), 3);
    environments.push_back(environment);
  }
  return environments;
}

/// The least that the parts of a step take, by its counts, the factor in half precision.
struct Floor {
  PartCost cost;
  double seconds = 0;

  void add(double times, const PartCost& part) {
    cost = cost + times * part;
    seconds += times * std::max(part.bytes / bandwidth, part.flops / single_rate);
  }
};

Floor floor_of(const Towel& towel, double iterations, double factorizations, double solves) {
  const FrontPlan fronts = plan_fronts(towel.plan->pattern, towel.plan->sheet.rest.vertices);
  const StepCost cost = step_cost(*towel.plan, fronts, lay_out(*towel.plan, towel.bending(), fronts));
  Floor floor;
  floor.add(iterations + 1, cost.evaluation);
  floor.add(iterations, cost.matrix);
  floor.add(factorizations, cost.preconditioner);
  floor.add(factorizations, cost.factorization);
  floor.add(solves, cost.solve);
  floor.add(solves, cost.product);
  return floor;
}

/// The environment with the most iterations.
struct Slowest {
  std::size_t environment = 0;
  double iterations = 0, substeps = 0;  ///< a step
  int most = 0, at_step = 0;            ///< iterations of the step that has most
};

Slowest slowest_of(const BatchReplay& replay) {
  Slowest slowest;
  for (int e = 0; e < replay.size(); ++e) {
    Slowest own;
    own.environment = static_cast<std::size_t>(e);
    const std::vector<ReplayStep> steps = replay.stats(e);
    for (std::size_t k = 0; k < steps.size(); ++k) {
      own.iterations += steps[k].iterations / double(steps.size());
      own.substeps += steps[k].substeps / double(steps.size());
      if (steps[k].iterations <= own.most) continue;
      own.most = steps[k].iterations;
      own.at_step = static_cast<int>(k);
    }
    if (own.iterations > slowest.iterations) slowest = own;
  }
  return slowest;
}

void time_replay(const Towel& towel, int environments, int steps, int stale_factor_solves, bool table,
                 int team_blocks) {
  ReplaySettings settings;
  settings.stale_factor_solves = stale_factor_solves;
  settings.steps = steps;
  settings.team_blocks = team_blocks;
  settings.kept_steps = {steps};
  const std::vector<ReplayEnvironment> all = lifts(towel, environments, steps, settings.time_step, table);
  BatchReplay replay(towel.plan, all, settings);
  using Clock = std::chrono::steady_clock;
  const auto start = Clock::now();
  replay.advance(steps);
  replay.synchronize();
  const double seconds = std::chrono::duration<double>(Clock::now() - start).count() / steps;
  double iterations = 0, solves = 0, factorizations = 0, substeps = 0, converged = 0;
  for (int e = 0; e < environments; ++e)
    for (const ReplayStep& step : replay.stats(e)) {
      iterations += step.iterations;
      solves += step.solves;
      factorizations += step.factorizations;
      substeps += step.substeps;
      converged += step.converged;
    }
  const auto slowest = slowest_of(replay);
  const double count = static_cast<double>(environments) * steps;
  const Floor floor = floor_of(towel, iterations / count, factorizations / count, solves / count);
  const double each = seconds / environments;
  std::printf("%8d %6d %6d %6d %10.3f %8.2f %8.2f %8.2f %8.3f %9.3f %10.2f %10.2f %8.1f %7.3f %7.3f\n",
              static_cast<int>(towel.positions.rows()), environments, replay.teams(), replay.team_blocks(),
              1e3 * seconds, iterations / count, factorizations / count, solves / count, substeps / count,
              100 * converged / count, 1e6 * each, 1e6 * floor.seconds, each / floor.seconds,
              floor.cost.bytes / each / bandwidth, floor.cost.flops / each / single_rate);
  std::printf(
      "         share of evaluation, matrix, preconditioner, factorization, solves, products, directions, "
      "contact, rest:");
  const std::vector<double> ticks = replay.phase_ticks();
  const double all_ticks = std::accumulate(ticks.begin(), ticks.end(), 0.0);
  for (const double each_ticks : ticks) std::printf(" %.3f", each_ticks / all_ticks);
  std::printf(
      "\n         slowest: E t %.4g N/m, D %.3g N m: %.2f iterations a step, %d in step %d, %.3f substeps\n",
      all[slowest.environment].material.membrane_stiffness,
      all[slowest.environment].material.bending_rigidity, slowest.iterations, slowest.most, slowest.at_step,
      slowest.substeps);
  std::fflush(stdout);
}

}  // namespace
}  // namespace flash::sim::cuda

int main(int count, char** arguments) {
  using namespace flash::sim::cuda;
  if (const std::string why = why_no_device(); !why.empty()) {
    std::fprintf(stderr, "flash_cuda_replay_bench: %s\n", why.c_str());
    return 2;
  }
  const std::vector<int> vertices = numbers_of(count > 1 ? arguments[1] : "1024,2025,4096"),
                         environments = numbers_of(count > 2 ? arguments[2] : "1,64,256,1024");
  const int steps = count > 3 ? std::stoi(arguments[3]) : 100,
            stale = count > 4 ? std::stoi(arguments[4]) : 5;
  const std::vector<int> blocks = numbers_of(count > 6 ? arguments[6] : "0");
  const bool table = count > 5 && std::string(arguments[5]) == "table";
  std::printf("%8s %6s %6s %6s %10s %8s %8s %8s %8s %9s %10s %10s %8s %7s %7s\n", "vertices", "envs", "teams",
              "blocks", "ms a step", "iters", "factors", "solves", "substeps", "conv. %", "us an env.",
              "floor us", "ratio", "of B/s", "of F/s");
  for (const int size : vertices) {
    const flash::sim::Towel towel(size);
    for (const int batch : environments)
      for (const int each : blocks) time_replay(towel, batch, steps, stale, table, each);
  }
}
