// The projective method on a fixed budget, five local-global iterations and up to ten of contact with the
// inertia metric, as it is published: corner lifts of a sheet of 0.4 m from a plane, each environment with E
// t from 10 to 300 N/m and D from 1e-5 to 1e-4 N m of its own, isometric bending. Usage:
// flash_cuda_projective_bench [SIDE[,...] [ENVIRONMENTS[,...] [STEPS [half|single [BLOCKS]]]]], SIDE in
// vertices, BLOCKS of a team.
// The time is that of the steps alone, the best of three runs; the residual says what five iterations leave.
#include <chrono>
#include <cmath>
#include <cstdio>
#include <string>

#include "data/mesh/procedural_mesh.h"
#include "sim/cuda/devices.h"
#include "sim/cuda/layout/inverse_tree.h"
#include "sim/cuda/projective_phases.h"
#include "sim/oracle/projective_system.h"
#include "tests/bench/corner_lift.h"
#include "tests/bench/device_bench.h"

namespace flash::sim::cuda {
namespace {

using Clock = std::chrono::steady_clock;

double milliseconds_since(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

std::vector<ReplayEnvironment> lifts(const SheetPlan& plan, int count, int steps, double time_step) {
  const data::Points& rest = plan.sheet.rest.vertices;
  ReplayEnvironment lift;
  lift.material.areal_density = 0.2;
  lift.material.friction = 0.3;
  lift.material.bending_model = data::BendingModel::isometric;
  lift.obstacles = {{Plane{}}};
  lift.holds = corner_lift(rest, steps, time_step);
  lift.positions = rest;
  lift.velocities = data::Points::Zero(rest.rows(), 3);
  std::vector<ReplayEnvironment> all(static_cast<std::size_t>(count), lift);
  for (int e = 0; e < count; ++e) {
    data::SheetMaterial& material = all[static_cast<std::size_t>(e)].material;
    material.membrane_stiffness = 10 * std::pow(30.0, (e + 0.5) / count);
    material.bending_rigidity = 1e-5 * std::pow(10.0, std::fmod(0.618034 * e, 1));
  }
  return all;
}

void run(int side, int environments, int steps, InversePrecision precision, int team_blocks) {
  data::RectangleMesh rectangle;
  rectangle.width = rectangle.height = 0.4;
  rectangle.cells_x = rectangle.cells_y = side - 1;
  const auto plan = make_sheet_plan(make_sheet(data::rectangle(rectangle)));
  ReplaySettings settings;
  settings.steps = steps;
  settings.precision = precision;
  settings.team_blocks = team_blocks;
  settings.threads = 0;
  settings.restart_interval = restart_interval;
  settings.projective.emplace();
  settings.projective->iterations = 5;
  settings.projective->acceleration = 0;
  settings.projective->metric = ContactMetric::inertia;
  settings.projective->constraints.iterations = 10;
  settings.projective->constraints.tolerance = 1e-9;
  double best = HUGE_VAL, start_up = 0, residual = 0, iterations = 0;
  int blocks = 0;
  std::vector<double> ticks;
  for (int round = 0; round < 3; ++round) {
    const auto begin = Clock::now();
    BatchReplay replay(plan, lifts(*plan, environments, steps, settings.time_step), settings);
    start_up = milliseconds_since(begin);
    const auto start = Clock::now();
    replay.advance(steps);
    replay.synchronize();
    best = std::min(best, milliseconds_since(start) / steps);
    if (round > 0) continue;
    blocks = replay.team_blocks();
    ticks = replay.phase_ticks();
    for (const int e : {0, environments / 2})
      for (const ReplayStep& step : replay.stats(e)) {
        residual = std::max(residual, step.residual);
        iterations += step.iterations / (2.0 * steps);
      }
  }
  double all = 0;
  for (const double t : ticks) all += t;
  std::printf("%8d %6d %6d %7s %10.4f %9.0f %6.2f %10.3g ", side * side, environments, blocks,
              precision == InversePrecision::half ? "half" : "single", best, start_up, iterations, residual);
  for (std::size_t k = 0; k < ticks.size(); ++k)
    std::printf(" %s %.0f %%", projective_phase_names[k], 100 * ticks[k] / all);
  std::printf("\n");
  std::fflush(stdout);
}

}  // namespace
}  // namespace flash::sim::cuda

int main(int count, char** arguments) {
  using namespace flash::sim::cuda;
  if (const std::string why = why_no_device(); !why.empty()) {
    std::fprintf(stderr, "flash_cuda_projective_bench: %s\n", why.c_str());
    return 2;
  }
  const std::vector<int> sides = numbers_of(count > 1 ? arguments[1] : "32,45,64"),
                         environments = numbers_of(count > 2 ? arguments[2] : "1,8,64,256,1024");
  const int steps = count > 3 ? std::stoi(arguments[3]) : 100;
  const InversePrecision precision =
      count > 4 && std::string(arguments[4]) == "single" ? InversePrecision::single : InversePrecision::half;
  std::printf("%8s %6s %6s %7s %10s %9s %6s %10s  %s\n", "vertices", "envs", "blocks", "factor", "ms a step",
              "ms before", "iters", "residual", "time by phase");
  for (const int side : sides)
    for (const int batch : environments)
      run(side, batch, steps, precision, count > 5 ? std::stoi(arguments[5]) : 0);
}
