// Prints how sheets and solids that meet themselves and each other do: what docs/theory.md and
// docs/performance.md say of it.

#include <cmath>
#include <cstdio>
#include <ctime>
#include <functional>
#include <numbers>
#include <string>

#include "sim/newton/solver.h"
#include "sim/pairs/intersection.h"
#include "tests/sim/layer_scenes.h"

namespace flash::sim {
namespace {

using data::Points;
using Eigen::Vector3d;

constexpr double h = 0.01;  // [s]

struct Study {
  std::string name;
  Sheet sheet;
  Environment world;
  int steps;
  std::function<void(int, Environment&)> before = {};
};

struct Result {
  double least = 1e300, last = 0, creep = 0, force_error = 0, seconds = 0;
  int unsolved = 0, halved = 0, intersections = 0, most_iterations = 0, most_touches = 0;
  long iterations = 0, solves = 0, factors = 0, pairs = 0, ways = 0;
  StepReport report;
};

/// Mass of each vertex [kg].
Eigen::VectorXd mass_of(const Study& study) {
  Eigen::VectorXd mass(study.sheet.rest.vertices.rows());
  for (int b = 0; b < static_cast<int>(study.sheet.bodies.size()); ++b) {
    const Body& body = study.sheet.bodies[b];
    const auto solid = study.world.solids.find(b);
    rows_of(body, mass) =
        solid != study.world.solids.end()
            ? Eigen::VectorXd(solid->second.density * rows_of(body, study.sheet.vertex_volume))
            : Eigen::VectorXd(study.world.materials[b].areal_density *
                              rows_of(body, study.sheet.vertex_area));
  }
  return mass;
}

/// What the reported forces lack of weight and change of momentum in a step, as a share of the weight.
double force_error(const Study& study, const Eigen::VectorXd& mass, const Points& velocities_before,
                   const StepReport& report) {
  Vector3d missing = mass.sum() * study.world.gravity;
  for (const Vector3d& force : report.obstacle_forces) missing += force;
  for (const Vector3d& force : report.hold_forces) missing += force;
  const Points change = (study.world.state.velocities - velocities_before) / h;
  missing -= (mass.asDiagonal() * change).colwise().sum().transpose();
  return missing.norm() / (mass.sum() * 9.81);
}

Result run(Study& study) {
  Solver solver(study.sheet, {.time_step = h});
  const Eigen::VectorXd mass = mass_of(study);
  PairSurface surface(study.sheet);
  Result r;
  Points before;
  for (int k = 0; k < study.steps; ++k) {
    if (study.before) study.before(k, study.world);
    before = study.world.state.positions;
    const Points velocities = study.world.state.velocities;
    const std::clock_t start = std::clock();
    r.report = solver.step(study.world);
    r.seconds += double(std::clock() - start) / CLOCKS_PER_SEC;
    r.force_error = std::max(r.force_error, force_error(study, mass, velocities, r.report));
    r.least = std::min(r.least, r.report.layer_distance);
    r.unsolved += !r.report.converged;
    r.halved += r.report.substeps > 1;
    r.iterations += r.report.iterations;
    r.most_iterations = std::max(r.most_iterations, r.report.iterations);
    r.most_touches = std::max(r.most_touches, r.report.layer_touches);
    r.solves += r.report.solves;
    r.factors += r.report.factorizations;
    r.pairs = std::max(r.pairs, r.report.layer_pairs);
    r.ways += r.report.layer_ways;
    r.intersections += first_intersection(surface, study.world.state.positions).has_value();
  }
  r.creep = (study.world.state.positions - before).rowwise().norm().maxCoeff() / h;
  r.last = r.report.layer_distance;
  return r;
}

Study study_of(const char* name, LayerScene scene, int steps) {
  return {name, std::move(scene.sheet), std::move(scene.environment), steps};
}

/// A folded sheet that a plate presses.
Study pressed(const SelfContact& settings) {
  Study study = study_of("pressed", fold(settings), 250);
  data::Trajectory path{{0, 1.2, 2.2, 2.5},
                        {Eigen::Isometry3d(Eigen::Translation3d(-0.05, 0, 0.2)),
                         Eigen::Isometry3d(Eigen::Translation3d(-0.05, 0, 0.06)),
                         Eigen::Isometry3d(Eigen::Translation3d(-0.05, 0, 0.0107)),
                         Eigen::Isometry3d(Eigen::Translation3d(-0.05, 0, 0.0107))}};
  Schedule schedule = *study.world.schedule;
  schedule.frames.clear();
  data::Trajectory gripper;
  const double right = study.sheet.rest.vertices.col(0).maxCoeff();
  for (int k = 0; k <= 100; ++k) {
    const double angle = std::numbers::pi * k / 100;
    gripper.times.push_back(0.01 * k);
    gripper.poses.push_back(
        Eigen::Isometry3d(Eigen::Translation3d(right - 0.1 * (1 - std::cos(angle)) * 0.9, 0,
                                               0.1 * std::sin(angle) + (k > 50 ? 2e-3 * (k - 50) / 50 : 0))));
  }
  const data::Trajectory both[2] = {gripper, path};
  study.world.schedule = make_schedule(both, 0.0, h, study.steps);
  study.world.obstacles.push_back(
      {.shape = Box{.half_extents = {0.1, 0.15, 0.01}}, .name = "plate", .frame = 1});
  return study;
}

void print(const Study& study, const Result& r) {
  std::printf(
      "| %s | %td | %d | %.3f | %.3f | %d | %.2g | %.1g | %.1f (%d) | %.1f | %.1f | %ld | %.1f | %d, %d |\n",
      study.name.c_str(), study.sheet.rest.vertices.rows(), r.most_touches, 1e3 * r.least, 1e3 * r.last,
      r.intersections, 1e3 * r.creep, r.force_error, double(r.iterations) / study.steps, r.most_iterations,
      double(r.solves) / study.steps, double(r.factors) / study.steps, r.pairs, 1e3 * r.seconds / study.steps,
      r.halved, r.unsolved);
  std::fflush(stdout);
}

/// Whether the last body of a scene slides: in half a second as fast as at a thousandth of a percent of the
/// weight, or it has stopped.
bool slides(const LayerScene& start) {
  constexpr int steps = 50;
  constexpr double share = 1e-5;
  LayerScene scene = start;
  Solver solver(scene.sheet, {.time_step = h, .tolerance = 1e-4});
  for (int k = 0; k < steps; ++k) solver.step(scene.environment);
  return mean_velocity(scene, scene.sheet.bodies.back()).x() > share * 9.81 * steps * h;
}

/// Prints the friction below which the last body of a scene slides, by bisection, beside the slope.
void print_threshold(const char* name, double slope, const SelfContact& settings,
                     const std::function<LayerScene(const SelfContact&)>& scene_of) {
  SelfContact contact = settings;
  double low = slope - 0.02, high = slope + 0.02;
  while (high - low > 1e-5) {
    contact.friction = 0.5 * (low + high);
    (slides(scene_of(contact)) ? low : high) = contact.friction;
  }
  std::printf("| %s | %.5f | %.5f | %.1e |\n", name, slope, low, std::abs(low - slope));
  std::fflush(stdout);
}

/// Iterations against the number of contacts: piles that fall a little, land and lie, over 0.6 s.
void print_contact_counts(const SelfContact& settings) {
  constexpr int steps = 60;
  std::puts(
      "| sheets | vertices | touches, at most | iterations a step (most) | solves an iteration | factors a "
      "step | "
      "ms a step | us a touch and iteration | halved, unsolved |\n|---|---|---|---|---|---|---|---|---|");
  for (const auto& [sheets, cells] : {std::pair{2, 12}, {4, 12}, {10, 12}, {10, 16}, {10, 24}, {20, 20}}) {
    Study study = study_of("pile", pile(sheets, settings, 0.2, cells), steps);
    const Result r = run(study);
    const double iterations = std::max(1.0, double(r.iterations));
    std::printf("| %d | %td | %d | %.1f (%d) | %.1f | %.2f | %.0f | %.2f | %d, %d |\n", sheets,
                study.sheet.rest.vertices.rows(), r.most_touches, iterations / steps, r.most_iterations,
                double(r.solves) / iterations, double(r.factors) / steps, 1e3 * r.seconds / steps,
                1e6 * r.seconds / iterations / std::max(1, r.most_touches), r.halved, r.unsolved);
    std::fflush(stdout);
  }
}

}  // namespace
}  // namespace flash::sim

int main(int argc, char** argv) {
  using namespace flash::sim;
  const SelfContact settings{.thickness = 1e-3, .friction = 0.3, .pressure = 2500};
  if (argc > 1 && std::string(argv[1]) == "contacts") {
    print_contact_counts(settings);
    return 0;
  }
  const auto tilted = [&](double slope) { return layer_on_incline(slope, settings); };
  std::vector<Study> studies = {
      study_of("two sheets", pile(2, settings, 0.2, 12), 200),
      study_of("ten sheets, 10 s", pile(10, settings, 0.2, 12), 1000),
      study_of("incline 0.299, holds", tilted(0.299), 200),
      study_of("fold", fold(settings), 200),
      pressed(settings),
      study_of("folded twice, pressed", folded_twice_and_pressed(settings, 0.006), 120),
      study_of("thrown at 2 m/s", thrown(settings, 2), 60),
      study_of("thrown at 20 m/s", thrown(settings, 20), 60),
      study_of("knot", strip_knot(settings, 0.95, 0.8), 120),
      study_of("pinch", pinched_layers(settings, 5), 60),
      study_of("block on block", block_on_incline(0.15, settings, false), 100),
      study_of("block, sheet, block", block_on_incline(0.15, settings, true), 100)};
  std::puts(
      "| scene | vertices | touches, at most | least mm | last mm | passing steps | creep mm/s | force "
      "error | iterations (most) | solves | factors | pairs | ms a step | halved, unsolved |\n"
      "|---|---|---|---|---|---|---|---|---|---|---|---|---|---|");
  for (Study& study : studies) {
    if (argc > 1 && study.name.find(argv[1]) == std::string::npos) continue;
    print(study, run(study));
  }
  if (argc > 1) return 0;
  std::puts("\n| what lies on a slope | slope | slides below a friction of | off by |\n|---|---|---|---|");
  print_threshold("sheet on sheet", 0.3, settings,
                  [](const SelfContact& contact) { return layer_on_incline(0.3, contact); });
  const double ten_degrees = std::tan(std::numbers::pi / 18);
  const auto print_blocks = [&](const char* name, bool between, const BlockMeshes& meshes) {
    print_threshold(name, ten_degrees, settings, [&](const SelfContact& contact) {
      return block_on_incline(ten_degrees, contact, between, meshes);
    });
  };
  print_blocks("block on sheet on block", true, {});
  print_blocks("block on block, 3 cells on 4", false, {});
  print_blocks("block on block, 7 cells on 9", false, {.lower = 9, .upper = 7});
  print_blocks("block on block, 7 cells on 9, turned by 0.4 rad", false,
               {.lower = 9, .upper = 7, .turn = 0.4});
  return 0;
}
