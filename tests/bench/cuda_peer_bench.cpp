// The lift on which other batched cloth simulators were timed, so that speeds can be compared at a stated
// accuracy: a square sheet of 0.4 m and 0.2 kg/m^2 lies on a plane with friction of 0.3; the vertices within
// 2 cm of a corner rise 0.25 m in 1.5 s and are held for 1 s. E t is 100 N/m and D 1e-4 N m. Usage:
// flash_cuda_peer_bench [SIDE[,...] [ENVIRONMENTS[,...] [TOLERANCE[,...]]]], SIDE in vertices.
// The error is the rms distance over the vertices to the answer with a tolerance of a thousandth.
#include <chrono>
#include <cstdio>

#include "data/mesh/procedural_mesh.h"
#include "sim/cuda/batch_system.h"
#include "sim/cuda/devices.h"
#include "tests/bench/corner_lift.h"
#include "tests/bench/device_bench.h"

namespace flash::sim::cuda {
namespace {

constexpr int steps = 250, judged_steps[] = {75, 150, 250};

struct Lifts {
  double milliseconds = 0;  ///< a step of all
  double iterations = 0, solves = 0, converged = 0;
  std::vector<data::Points> positions;  ///< of the first one, at judged_steps
};

Lifts run_lifts(const std::shared_ptr<const SheetPlan>& plan, int environments, double tolerance) {
  ReplaySettings settings;
  settings.tolerance = tolerance;
  settings.steps = steps;
  settings.kept_steps.assign(std::begin(judged_steps), std::end(judged_steps));
  ReplayEnvironment environment;
  const data::Points& rest = plan->sheet.rest.vertices;
  environment.material.membrane_stiffness = 100;
  environment.material.bending_rigidity = 1e-4;
  environment.material.areal_density = 0.2;
  environment.material.friction = 0.3;
  environment.obstacles = {{Plane{}}};
  environment.holds = corner_lift(rest, steps, settings.time_step);
  environment.positions = rest;
  environment.velocities = data::Points::Zero(rest.rows(), 3);
  BatchReplay replay(
      plan, std::vector<ReplayEnvironment>(static_cast<std::size_t>(environments), environment), settings);
  const auto start = std::chrono::steady_clock::now();
  replay.advance(steps);
  replay.synchronize();
  Lifts lifts;
  lifts.milliseconds =
      1e3 * std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count() / steps;
  for (const ReplayStep& step : replay.stats(0)) {
    lifts.iterations += step.iterations / double(steps);
    lifts.solves += step.solves / double(steps);
    lifts.converged += step.converged / double(steps);
  }
  for (int k = 0; k < 3; ++k) lifts.positions.push_back(replay.kept_positions(0, k));
  return lifts;
}

double rms_millimetres(const data::Points& a, const data::Points& b) {
  return 1e3 * std::sqrt((a - b).rowwise().squaredNorm().mean());
}

}  // namespace
}  // namespace flash::sim::cuda

int main(int count, char** arguments) {
  using namespace flash::sim::cuda;
  if (const std::string why = why_no_device(); !why.empty()) {
    std::fprintf(stderr, "flash_cuda_peer_bench: %s\n", why.c_str());
    return 2;
  }
  const std::vector<int> sides = numbers_of(count > 1 ? arguments[1] : "32"),
                         environments = numbers_of(count > 2 ? arguments[2] : "1,8,64,128,256,1024");
  std::vector<double> tolerances;
  for (const int exponent : numbers_of(count > 3 ? arguments[3] : "2,3"))
    tolerances.push_back(std::pow(10.0, -exponent));
  std::printf("%8s %10s %6s %10s %8s %8s %8s %s\n", "vertices", "tolerance", "envs", "ms a step", "iters",
              "solves", "conv. %", "error after 0.75, 1.5 and 2.5 s [mm]");
  for (const int side : sides) {
    flash::data::RectangleMesh rectangle;
    rectangle.width = rectangle.height = 0.4;
    rectangle.cells_x = rectangle.cells_y = side - 1;
    const auto plan = flash::sim::make_sheet_plan(flash::sim::make_sheet(flash::data::rectangle(rectangle)));
    for (const double tolerance : tolerances) {
      const Lifts exact = run_lifts(plan, 1, 1e-3 * tolerance);
      for (const int batch : environments) {
        const Lifts lifts = run_lifts(plan, batch, tolerance);
        std::printf("%8d %10.0e %6d %10.3f %8.2f %8.2f %8.2f", side * side, tolerance, batch,
                    lifts.milliseconds, lifts.iterations, lifts.solves, 100 * lifts.converged);
        for (std::size_t k = 0; k < lifts.positions.size(); ++k)
          std::printf(" %.4f", rms_millimetres(lifts.positions[k], exact.positions[k]));
        std::printf("  (tight answer converged in %.1f %% of its steps)\n", 100 * exact.converged);
        std::fflush(stdout);
      }
    }
  }
}
