// Prints how three methods keep layers apart on the same scenes, as docs/experiments.md says: the barrier of
// the library, and two prototypes with hard rows.

#include <algorithm>
#include <cstdio>
#include <ctime>
#include <functional>
#include <string>
#include <vector>

#include "sim/newton/solver.h"
#include "sim/pairs/intersection.h"
#include "tests/prototype/row_solver.h"
#include "tests/sim/layer_scenes.h"

namespace flash::sim {
namespace {

using data::Points;
using Eigen::Vector3d;

constexpr double h = 0.01;         // [s]
constexpr int most_unsolved = 10;  // steps, after which a run ends: what follows them means little
constexpr SelfContact contact{.thickness = 1e-3, .friction = 0.3, .pressure = 2500};

struct Study {
  std::string name;
  LayerScene scene;
  int steps;
};

using Step = std::function<StepReport(Environment&)>;

struct Result {
  double least = 1e300, creep = 0, force_error = 0, seconds = 0;
  int steps = 0, unsolved = 0, halved = 0, passing = 0, most_iterations = 0;
  long iterations = 0, solves = 0, factors = 0;
};

Result run(const Study& study, const Step& step) {
  const Sheet& sheet = study.scene.sheet;
  Environment world = study.scene.environment;
  PairSurface surface(sheet);
  const auto plan = make_sheet_plan(sheet);
  const Eigen::VectorXd mass = StepProblem(*plan, world, h, {}).potential.mass();
  Result r;
  Points moved;
  for (; r.steps < study.steps && r.unsolved < most_unsolved; ++r.steps) {
    const State start = world.state;
    const std::clock_t begin = std::clock();
    const StepReport report = step(world);
    r.seconds += double(std::clock() - begin) / CLOCKS_PER_SEC;
    moved = world.state.positions - start.positions;
    // What the reported forces lack of weight and change of momentum.
    const Points change = (world.state.velocities - start.velocities) / h;
    Vector3d missing = mass.sum() * world.gravity - (mass.asDiagonal() * change).colwise().sum().transpose();
    for (const Vector3d& force : report.obstacle_forces) missing += force;
    for (const Vector3d& force : report.hold_forces) missing += force;
    r.force_error = std::max(r.force_error, missing.norm() / (mass.sum() * 9.81));
    r.least = std::min(r.least, report.layer_distance);
    r.unsolved += !report.converged;
    r.halved += report.substeps > 1;
    r.iterations += report.iterations;
    r.most_iterations = std::max(r.most_iterations, report.iterations);
    r.solves += report.solves;
    r.factors += report.factorizations;
    r.passing += first_intersection(surface, world.state.positions).has_value();
  }
  r.creep = moved.rowwise().norm().maxCoeff() / h;
  return r;
}

void print(const Study& study, const char* method, const Result& r) {
  std::printf("| %s | %s | %.4f | %d | %.2g | %.1g | %.1f (%d) | %.1f | %.1f | %.1f | %d, %d of %d |\n",
              study.name.c_str(), method, 1e3 * (contact.thickness - r.least), r.passing, 1e3 * r.creep,
              r.force_error, double(r.iterations) / r.steps, r.most_iterations, double(r.solves) / r.steps,
              double(r.factors) / r.steps, 1e3 * r.seconds / r.steps, r.halved, r.unsolved, r.steps);
  std::fflush(stdout);
}

}  // namespace
}  // namespace flash::sim

int main(int argc, char** argv) {
  using namespace flash::sim;
  const std::vector<Study> studies = {
      {"two sheets", pile(2, contact, 0.2, 12), 200},
      {"ten sheets", pile(10, contact, 0.2, 12), 60},
      {"incline 0.299, holds", layer_on_incline(0.299, contact), 200},
      {"fold", fold(contact), 200},
      {"folded twice, pressed", folded_twice_and_pressed(contact, 0.006), 120},
      {"thrown at 2 m/s", thrown(contact, 2), 60},
      {"pinch", pinched_layers(contact, 5), 60},
      {"block, sheet, block", block_on_incline(0.15, contact, true), 100}};
  std::puts(
      "| scene | method | penetration mm | passing steps | creep mm/s | force error | iterations (most) | "
      "solves | factors | ms a step | halved, unsolved of steps "
      "|\n|---|---|---|---|---|---|---|---|---|---|---|");
  for (const Study& study : studies) {
    if (argc > 1 && study.name.find(argv[1]) == std::string::npos) continue;
    const SolverSettings settings{.time_step = h, .halvings = 4};
    const auto print_with = [&](const char* method, auto solver) {
      print(study, method, run(study, [&](Environment& world) { return solver.step(world); }));
    };
    print_with("barrier", Solver(study.scene.sheet, settings));
    print_with("multipliers", RowSolver(study.scene.sheet, RowMethod::multipliers, settings));
    print_with("augmented", RowSolver(study.scene.sheet, RowMethod::augmented, settings));
  }
  return 0;
}
