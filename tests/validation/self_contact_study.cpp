// Prints how sheets that meet themselves and each other do on six scenes: what docs/theory.md says of it.

#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <functional>
#include <numbers>
#include <string>

#include "data/procedural_mesh.h"
#include "sim/newton/solver.h"
#include "sim/pairs/intersection.h"

namespace flash::sim {
namespace {

using data::Points;
using Eigen::Vector3d;

constexpr double h = 0.01;  // [s]

Sheet square_sheet(double side, int cells,
                   data::DiagonalPattern pattern = data::DiagonalPattern::alternating) {
  return make_sheet(data::rectangle(
      {.width = side, .height = side, .cells_x = cells, .cells_y = cells, .pattern = pattern}));
}

Environment world_of(const Sheet& sheet, const SelfContact& settings) {
  Environment world;
  world.materials.assign(sheet.bodies.size(),
                         data::SheetMaterial{.bending_model = data::BendingModel::hinge});
  world.state.positions = sheet.rest.vertices;
  world.state.velocities = Points::Zero(sheet.rest.vertices.rows(), 3);
  world.self_contact = settings;
  return world;
}

struct Study {
  std::string name;
  Sheet sheet;
  Environment world;
  int steps;
  std::function<void(int, Environment&)> before = {};
};

struct Result {
  double least = 1e300, last = 0, creep = 0, seconds = 0;
  int unsolved = 0, halved = 0, intersections = 0, most_iterations = 0;
  long iterations = 0, solves = 0, factors = 0, pairs = 0, ways = 0;
  StepReport report;
};

Result run(Study& study) {
  Solver solver(study.sheet, {.time_step = h});
  PairSurface surface(study.sheet);
  Result r;
  Points before;
  for (int k = 0; k < study.steps; ++k) {
    if (study.before) study.before(k, study.world);
    before = study.world.state.positions;
    const auto start = std::chrono::steady_clock::now();
    r.report = solver.step(study.world);
    r.seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    r.least = std::min(r.least, r.report.layer_distance);
    r.unsolved += !r.report.converged;
    r.halved += r.report.substeps > 1;
    r.iterations += r.report.iterations;
    r.most_iterations = std::max(r.most_iterations, r.report.iterations);
    r.solves += r.report.solves;
    r.factors += r.report.factorizations;
    r.pairs = std::max(r.pairs, r.report.layer_pairs);
    r.ways += r.report.layer_ways;
    r.intersections += first_intersection(surface, study.world.state.positions).has_value();
    if (std::getenv("TRACE"))
      std::printf(
          "%4d it %3d solves %4d fac %3d sub %3d conv %d touches %5d closest %.3g res %.2g pairs %ld ways "
          "%ld\n",
          k, r.report.iterations, r.report.solves, r.report.factorizations, r.report.substeps,
          r.report.converged, r.report.layer_touches, r.report.layer_distance, r.report.residual,
          r.report.layer_pairs, r.report.layer_ways);
  }
  r.creep = (study.world.state.positions - before).rowwise().norm().maxCoeff() / h;
  r.last = r.report.layer_distance;
  return r;
}

Sheet stacked(int count, double side, int cells) {
  std::vector<Sheet> sheets;
  for (int k = 0; k < count; ++k)
    sheets.push_back(square_sheet(
        side, cells, k % 2 == 0 ? data::DiagonalPattern::alternating : data::DiagonalPattern::jittered));
  return joined(sheets);
}

/// A pile of sheets on a table, each let go somewhat above the one below.
Study pile(const char* name, int count, const SelfContact& settings, double tilt = 0, int steps = 200) {
  Study study{name, stacked(count, 0.2, 12), {}, steps};
  study.world = world_of(study.sheet, settings);
  study.world.gravity = 9.81 * Vector3d(std::sin(tilt), 0, -std::cos(tilt));
  study.world.obstacles.push_back({.shape = Plane{}, .friction = std::vector<double>(count, 2.0)});
  for (int k = 0; k < count; ++k)
    rows_of(study.sheet.bodies[k], study.world.state.positions).col(2).array() +=
        1.05 * settings.thickness * k;
  return study;
}

/// A strip whose one end is carried over and laid down on the other in a second, and let go.
Study fold(const SelfContact& settings) {
  Study study{"fold", square_sheet(0.2, 16), {}, 200};
  study.world = world_of(study.sheet, settings);
  study.world.obstacles.push_back({.shape = Plane{}});
  std::vector<int> edge;
  for (int i = 0; i < study.sheet.rest.vertices.rows(); ++i)
    if (study.sheet.rest.vertices(i, 0) > study.sheet.rest.vertices.col(0).maxCoeff() - 1e-9)
      edge.push_back(i);
  const double right = study.sheet.rest.vertices.col(0).maxCoeff();
  data::Trajectory path;
  for (int k = 0; k <= 100; ++k) {
    const double angle = std::numbers::pi * k / 100;
    path.times.push_back(0.01 * k);
    path.poses.push_back(
        Eigen::Isometry3d(Eigen::Translation3d(right - 0.1 * (1 - std::cos(angle)) * 0.9, 0,
                                               0.1 * std::sin(angle) + (k > 50 ? 2e-3 * (k - 50) / 50 : 0))));
  }
  Schedule schedule = *make_schedule({&path, 1}, 0.0, h, 100);
  study.world.schedule = std::make_shared<const Schedule>(schedule);
  study.world.holds.push_back({.name = "gripper", .vertices = edge, .frame = 0, .to = 1.0});
  return study;
}

/// Both halves of a folded sheet thrown at each other.
Study thrown(const SelfContact& settings, double speed) {
  Study study{"thrown", square_sheet(0.2, 16), {}, 60};
  study.world = world_of(study.sheet, settings);
  Points& x = study.world.state.positions;
  const double middle = 0.5 * (x.col(0).maxCoeff() + x.col(0).minCoeff());
  for (int i = 0; i < x.rows(); ++i) {
    const double from = x(i, 0) - middle, radius = 0.02, half = 0.5 * std::numbers::pi * radius;
    // A U: two straight legs and a half circle.
    if (std::abs(from) < half) {
      x(i, 0) = middle + radius * std::cos(from / radius);
      x(i, 2) = radius * std::sin(from / radius);
    } else {
      x(i, 0) = middle - (std::abs(from) - half);
      x(i, 2) = from > 0 ? radius : -radius;
    }
    x(i, 1) *= from > 0 ? 0.97 : 1.0;
    study.world.state.velocities(i, 2) = from > 0 ? -0.5 * speed : 0.5 * speed;
  }
  return study;
}

/// A folded sheet that a plate presses.
Study pressed(const SelfContact& settings) {
  Study study = fold(settings);
  study.name = "pressed";
  study.steps = 250;
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
  std::printf("| %s | %td | %.3f | %.3f | %d | %.3g | %.2f (%d) | %.1f | %.1f | %ld | %.2f | %d, %d |\n",
              study.name.c_str(), study.sheet.rest.vertices.rows(), 1e3 * r.least, 1e3 * r.last,
              r.intersections, 1e3 * r.creep, double(r.iterations) / study.steps, r.most_iterations,
              double(r.solves) / study.steps, double(r.factors) / study.steps, r.pairs,
              1e3 * r.seconds / study.steps, r.halved, r.unsolved);
  std::fflush(stdout);
}

}  // namespace
}  // namespace flash::sim

int main(int argc, char** argv) {
  using namespace flash::sim;
  const SelfContact settings{.thickness = 1e-3, .friction = 0.3, .pressure = 2500};
  std::vector<Study> studies = {pile("two sheets", 2, settings),
                                pile("ten sheets", 10, settings),
                                pile("incline, holds", 2, settings, std::atan(0.29)),
                                fold(settings),
                                pressed(settings),
                                thrown(settings, 2)};
  std::puts(
      "| scene | vertices | least mm | last mm | passing steps | creep mm/s | iterations (most) | solves | "
      "factors "
      "| pairs | ms | halved, unsolved |\n|---|---|---|---|---|---|---|---|---|---|---|---|");
  for (Study& study : studies) {
    if (argc > 1 && study.name.find(argv[1]) == std::string::npos) continue;
    print(study, run(study));
  }
  return 0;
}
