// Sheets on obstacles: replays on the device beside the processor's Solver, and closed forms.
#ifdef FLASH_HAVE_CUDA
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <string>

#include "sim/cuda/batch_replay.h"
#include "sim/cuda/batch_system.h"
#include "sim/cuda/devices.h"
#include "sim/cuda/hold_motion.h"
#include "sim/cuda/most_obstacles.h"
#include "sim/newton/solver.h"
#include "tests/sim/sheet_scene.h"
#include "tests/sim/sliding_mass.h"

namespace flash::sim::cuda {
namespace {

using data::Points;
using Eigen::Isometry3d;
using Eigen::Vector3d;

#define SKIP_WITHOUT_DEVICE() \
  if (const std::string why = why_no_device(); !why.empty()) GTEST_SKIP() << why

constexpr double time_step = 0.01;

struct Scene {
  std::string name;
  std::shared_ptr<const SheetPlan> plan;
  Environment environment;
  int steps;
};

std::shared_ptr<const SheetPlan> sheet(int cells = 10) {
  return make_sheet_plan(small_sheet(cells, 0.02 * cells));
}

/// A sheet `height` above the plane z = 0, not quite flat: flat ones stand in equilibrium under compression.
Environment above(const SheetPlan& plan, double height) {
  Environment environment = environment_of(plan.sheet);
  Points& x = environment.state.positions;
  for (int i = 0; i < x.rows(); ++i) x(i, 2) = height + 1e-4 * (1 + std::sin(20 * x(i, 0) + 30 * x(i, 1)));
  environment.materials[0].membrane_stiffness = 60;
  environment.materials[0].bending_rigidity = 5e-5;
  environment.materials[0].areal_density = 0.2;
  environment.materials[0].friction = 0.3;
  return environment;
}

Vector3d middle_of(const SheetPlan& plan) { return plan.sheet.rest.vertices.colwise().mean(); }

data::Trajectory path(const std::vector<double>& times, const std::vector<Isometry3d>& poses) {
  return {times, poses};
}

Isometry3d moved(const Vector3d& by, double angle = 0) {
  return Eigen::Translation3d(by) * Eigen::AngleAxisd(angle, Vector3d::UnitY());
}

std::vector<Scene> scenes() {
  std::vector<Scene> scenes;
  const auto plan = sheet();
  const Vector3d middle = middle_of(*plan);
  const auto add = [&](std::string name, double height, int steps,
                       const std::function<void(Environment&)>& change) {
    Scene scene{std::move(name), plan, above(*plan, height), steps};
    change(scene.environment);
    scenes.push_back(scene);
  };
  const auto lift = [](Environment& e) {
    e.holds.push_back(gripped(e, {0, 1, 11, 12}, straight_path(Vector3d::Zero(), {0.03, 0.03, 0.06}, 0.25)));
    e.holds.back().targets = {};
  };
  add("falls on a plane", 0.005, 25, [](Environment& e) { e.obstacles = {{Plane{}}}; });
  add("lift from a table", 0, 40, [&](Environment& e) {
    e.obstacles = {{Plane{}}};
    lift(e);
  });
  add("lift from a smooth table", 0, 30, [&](Environment& e) {
    e.obstacles = {{Plane{}}};
    e.materials[0].friction = 0;
    lift(e);
  });
  add("over a box", 0.002, 25, [&](Environment& e) {
    Box box{.half_extents = {0.04, 0.03, 0.05}};
    box.pose = Eigen::Translation3d(middle.x() + 0.013, middle.y(), -0.05) *
               Eigen::AngleAxisd(0.3, Vector3d::UnitZ());
    e.obstacles = {{box}, {Plane{{0, 0, -0.08}, Vector3d::UnitZ()}}};
  });
  add("over a cylinder", 0.002, 25, [&](Environment& e) {
    e.obstacles = {
        {Cylinder{{middle.x(), middle.y() + 0.01, -0.03}, Vector3d(1, 0.2, 0).normalized(), 0.03}}};
  });
  add("pushed by a box", 0, 30, [&](Environment& e) {
    Box box{.half_extents = {0.01, 0.06, 0.01}};
    box.pose = Isometry3d(Eigen::Translation3d(-0.02, middle.y(), 0.011));
    e.obstacles = {{Plane{}}, {box}};
    e.obstacles[1].frame = add_frame(e, straight_path(Vector3d::Zero(), {0.05, 0, 0}, 0.3));
  });
  add("struck from below by a turning bar", 0.03, 20, [&](Environment& e) {
    Box bar{.half_extents = {0.05, 0.01, 0.002}};
    e.obstacles = {{bar}};
    // 1.2 m/s: three times its thickness in a step.
    e.obstacles[0].frame = add_frame(
        e, path({0, 0.05}, {moved({middle.x(), middle.y(), 0}), moved({middle.x(), middle.y(), 0.06}, 0.4)}));
  });
  add("a cylinder rolls under it", 0.0, 25, [&](Environment& e) {
    e.obstacles = {{Plane{{0, 0, -0.002}, Vector3d::UnitZ()}},
                   {Cylinder{{0, 0, 0}, Vector3d::UnitY(), 0.01}}};
    e.obstacles[1].frame = add_frame(
        e, path({0, 0.25}, {moved({middle.x() - 0.05, 0, -0.013}), moved({middle.x(), 0, -0.005}, 2)}));
  });
  add("between three planes", 0.01, 25, [&](Environment& e) {
    e.obstacles = {{Plane{}},
                   {Plane{{0.21, 0, 0}, Vector3d(-1, 0, 0.2).normalized()}},
                   {Plane{{0, 0.21, 0}, Vector3d(0, -1, 0.1).normalized()}}};
    e.state.velocities.col(0).setConstant(0.3);
    e.state.velocities.col(1).setConstant(0.3);
  });
  add("starts below a table", -0.003, 6, [](Environment& e) { e.obstacles = {{Plane{}}}; });
  add("starts in a box", 0.0, 6, [&](Environment& e) {
    Box box{.half_extents = {0.05, 0.04, 0.01}};
    box.pose = Isometry3d(Eigen::Translation3d(middle.x() + 0.01, middle.y(), -0.003));
    e.obstacles = {{box}};
  });
  add("starts in a cylinder", 0.0, 6, [&](Environment& e) {
    e.obstacles = {{Cylinder{{middle.x(), middle.y() + 0.01, 0.001}, Vector3d::UnitX(), 0.012}}};
  });
  add("over a sphere", 0.002, 25, [&](Environment& e) {
    e.obstacles = {{Capsule{{middle.x() + 0.01, middle.y(), -0.05}, Vector3d::UnitZ(), 0, 0.05}}};
  });
  add("a finger turns up from below", 0.03, 20, [&](Environment& e) {
    e.obstacles = {{Capsule{Vector3d::Zero(), Vector3d::UnitX(), 0.03, 0.01}}};
    e.obstacles[0].frame = add_frame(
        e, path({0, 0.05}, {moved({middle.x(), middle.y(), 0}), moved({middle.x(), middle.y(), 0.06}, 0.4)}));
  });
  add("on a table beside a capsule", 0.002, 20, [&](Environment& e) {
    e.obstacles = {{Plane{}},
                   {Capsule{{middle.x(), middle.y(), 0.0}, Vector3d(1, 1, 0).normalized(), 0.03, 0.01}}};
    e.state.positions.col(2).array() += 0.01;
  });
  add("starts in a capsule", 0.0, 6, [&](Environment& e) {
    e.obstacles = {{Capsule{{middle.x(), middle.y() + 0.01, 0.001}, Vector3d::UnitX(), 0.04, 0.012}}};
  });
  return scenes;
}

struct Trajectory {
  std::vector<Points> positions;
  std::vector<ReplayStep> steps;
  std::vector<Vector3d> forces;  ///< of the first hold, where there is one
};

Trajectory by_processor(const Scene& scene, double tolerance, int stale_factor_solves = 0) {
  Environment environment = scene.environment;
  Solver solver(scene.plan,
                {.time_step = time_step, .tolerance = tolerance, .stale_factor_solves = stale_factor_solves});
  Trajectory trajectory;
  for (int k = 0; k < scene.steps; ++k) {
    const StepReport report = solver.step(environment);
    trajectory.positions.push_back(environment.state.positions);
    for (const Vector3d& force : report.hold_forces) trajectory.forces.push_back(force);
    trajectory.steps.push_back({report.residual, report.penetration_max, report.iterations, report.solves,
                                report.factorizations, report.substeps, report.converged});
  }
  return trajectory;
}

ReplaySettings settings_of(int steps, double tolerance) {
  ReplaySettings settings;
  settings.time_step = time_step;
  settings.tolerance = tolerance;
  settings.stale_factor_solves = 0;
  settings.steps = steps;
  for (int k = 1; k <= steps; ++k) settings.kept_steps.push_back(k);
  return settings;
}

ReplayEnvironment for_device(const Scene& scene) {
  Environment environment = scene.environment;
  const auto motion =
      std::make_shared<const HoldMotion>(motion_of_holds(environment, time_step, scene.steps));
  return replay_environment(scene.environment, motion);
}

std::vector<Trajectory> by_device(const std::shared_ptr<const SheetPlan>& plan,
                                  const std::vector<ReplayEnvironment>& environments,
                                  const ReplaySettings& settings) {
  BatchReplay replay(plan, environments, settings);
  replay.advance(settings.steps);
  std::vector<Trajectory> all;
  for (int e = 0; e < replay.size(); ++e) {
    Trajectory& own = all.emplace_back();
    for (int k = 0; k < settings.steps; ++k) own.positions.push_back(replay.kept_positions(e, k));
    own.steps = replay.stats(e);
    const std::vector<double> forces = replay.hold_forces(e);
    for (std::size_t k = 0; k < forces.size(); k += 3)
      own.forces.emplace_back(forces[k], forces[k + 1], forces[k + 2]);
  }
  return all;
}

double weight_of(const Scene& scene) {
  return 9.81 * scene.environment.materials[0].areal_density * scene.plan->sheet.vertex_area.sum();
}

double size_of(const SheetPlan& plan) {
  const Points& rest = plan.sheet.rest.vertices;
  return (rest.colwise().maxCoeff() - rest.colwise().minCoeff()).norm();
}

/// Steps that both take in the same parts, by the same exits. Beyond them they solve different equations: a
/// step in halves is another discretization, and at a threshold rounding decides whether it is halved, or
/// whether the way out of an obstacle is given up after as many iterations as there may be.
std::size_t common_steps(const Trajectory& a, const Trajectory& b) {
  const int most_iterations = SolverSettings{}.max_iterations;
  const auto alike = [most_iterations](const ReplayStep& s, const ReplayStep& t) {
    return s.substeps == t.substeps && (s.iterations < most_iterations) == (t.iterations < most_iterations);
  };
  std::size_t count = 0;
  while (count < a.steps.size() && alike(a.steps[count], b.steps[count])) ++count;
  return count;
}

/// Largest distance of a vertex in the first `steps`, as a share of the sheet's size.
double distance(const Scene& scene, const Trajectory& a, const Trajectory& b, std::size_t steps) {
  double largest = 0;
  for (std::size_t k = 0; k < steps; ++k) {
    const double own = (a.positions[k] - b.positions[k]).rowwise().norm().maxCoeff();
    largest = own <= largest ? largest : own;
  }
  return largest / size_of(*scene.plan);
}

/// How far two solutions of a scene may drift apart, as a share of the sheet's size: a residual of the
/// tolerance is an acceleration of so much of gravity, in every step of both.
double drift(const Scene& scene, double tolerance) {
  const double time = scene.steps * settings_of(scene.steps, tolerance).time_step;
  return tolerance * 9.81 * time * time / size_of(*scene.plan);
}

/// Steps in which the processor finds one solution, whatever its factors are. A sheet that buckles or folds
/// has several, each as good, and rounding decides which one a solver comes to.
std::size_t steps_of_one_solution(const Scene& scene, double tolerance, const Trajectory& processor) {
  std::size_t count = processor.steps.size();
  for (const int stale_factor_solves : {1, 2, 3, 4, 5}) {
    const Trajectory other = by_processor(scene, tolerance, stale_factor_solves);
    count = std::min(count, common_steps(other, processor));
    while (count > 0 && distance(scene, other, processor, count) > drift(scene, tolerance)) --count;
  }
  return count;
}

TEST(BatchContact, TrajectoriesAreThoseOfTheProcessorAndCloserAsTheToleranceFalls) {
  SKIP_WITHOUT_DEVICE();
  int soon_apart = 0, compared = 0;
  for (const Scene& scene : scenes()) {
    for (const double tolerance : {1e-3, 1e-5}) {
      ++compared;
      SCOPED_TRACE(scene.name + ", tolerance " + std::to_string(tolerance));
      const Trajectory device =
                           by_device(scene.plan, {for_device(scene)}, settings_of(scene.steps, tolerance))[0],
                       processor = by_processor(scene, tolerance);
      int unconverged = 0;
      // Where the processor solves a step the device does.
      for (std::size_t k = 0; k < device.steps.size(); ++k)
        unconverged += processor.steps[k].converged && !device.steps[k].converged;
      const std::size_t steps =
          std::min(common_steps(device, processor), steps_of_one_solution(scene, tolerance, processor));
      for (std::size_t k = 0; k < steps; ++k)
        EXPECT_NEAR(device.steps[k].penetration_max, processor.steps[k].penetration_max, 1e-6);
      EXPECT_EQ(unconverged, 0);
      soon_apart += steps < 5;
      EXPECT_LE(distance(scene, device, processor, steps), drift(scene, tolerance));
      // Each is within the residual of its step; what a hold carries beyond is of the positions.
      ASSERT_EQ(device.forces.size(), processor.forces.size());
      const double weight = weight_of(scene);
      for (std::size_t k = 0; k < std::min(device.forces.size(), steps); ++k)
        EXPECT_LE((device.forces[k] - processor.forces[k]).norm(),
                  100 * tolerance * weight + 1e-2 * processor.forces[k].norm());
    }
  }
  // Which ones a threshold parts at once is chance; all but a tenth are compared over several steps.
  EXPECT_LE(10 * soon_apart, compared);
}

TEST(BatchContact, ABatchEqualsAloneBitwiseRunAfterRun) {
  SKIP_WITHOUT_DEVICE();
  // Those with a schedule of their own, and without: all in one batch.
  const std::vector<Scene> all = scenes();
  constexpr int steps = 6;
  ReplaySettings settings = settings_of(steps, 1e-3);
  settings.restart_interval = 3;
  std::vector<ReplayEnvironment> environments;
  for (int round = 0; round < 20; ++round)
    for (const Scene& scene : all) {
      environments.push_back(for_device(scene));
      environments.back().material.membrane_stiffness += round;
      environments.back().hold_count = 1;
    }
  const auto together = by_device(all[0].plan, environments, settings),
             again = by_device(all[0].plan, environments, settings);
  for (std::size_t e = 0; e < environments.size(); ++e) {
    EXPECT_EQ(together[e].positions, again[e].positions);
    if (e >= all.size() && e % 20 != 3) continue;
    EXPECT_EQ(together[e].positions, by_device(all[0].plan, {environments[e]}, settings)[0].positions);
  }
}

/// A flat sheet on a plane that leans by `angle`, under gravity that is turned instead.
Scene on_incline(double angle, double friction) {
  const auto plan = sheet(6);
  Scene scene{"incline", plan, environment_of(plan->sheet), 20};
  Environment& e = scene.environment;
  e.materials[0].membrane_stiffness = 60;
  e.materials[0].bending_rigidity = 5e-5;
  e.materials[0].friction = friction;
  e.gravity = 9.81 * Vector3d(std::sin(angle), 0, -std::cos(angle));
  e.obstacles = {{Plane{}}};
  return scene;
}

TEST(BatchContact, OnAnInclineASheetSticksBelowTheAngleOfFrictionAndSlidesAbove) {
  SKIP_WITHOUT_DEVICE();
  constexpr double friction = 0.4;
  const double limit = std::atan(friction);
  for (const double share : {0.2, 0.99, 1.01, 1.5}) {
    SCOPED_TRACE(share);
    const Scene scene = on_incline(share * limit, friction);
    const Trajectory device = by_device(scene.plan, {for_device(scene)}, settings_of(scene.steps, 1e-6))[0];
    const Points moved = device.positions.back() - scene.environment.state.positions;
    for (const ReplayStep& step : device.steps) EXPECT_TRUE(step.converged);
    if (share < 1) {
      // Bristles bend by their length. The speed that is left then, length / h, is braked by the rest of
      // friction.
      const double longest = bristle_length(time_step), speed = longest / time_step,
                   braking = 9.81 * (friction * std::cos(share * limit) - std::sin(share * limit));
      EXPECT_LE(moved.cwiseAbs().maxCoeff(), longest + 0.5 * speed * speed / braking);
      continue;
    }
    // Of the weight 30 times the tolerance may be missing.
    const double expected = slide_down(share * limit, friction, 9.81, time_step, scene.steps).place,
                 seconds = scene.steps * time_step;
    EXPECT_LE((moved.col(0).array() - expected).abs().maxCoeff(), 0.5 * 3e-5 * 9.81 * seconds * seconds);
    EXPECT_LE(moved.rightCols(2).cwiseAbs().maxCoeff(), 1e-9);
  }
}

TEST(BatchContact, ASheetAtRestPushesWithItsWeightAlone) {
  SKIP_WITHOUT_DEVICE();
  // Nothing moves: the table carries each vertex where it is.
  const Scene scene = on_incline(0, 0.3);
  const Trajectory device = by_device(scene.plan, {for_device(scene)}, settings_of(5, 1e-6))[0];
  EXPECT_EQ((device.positions.back() - scene.environment.state.positions).cwiseAbs().maxCoeff(), 0);
}

TEST(BatchContact, MoreObstaclesThanThereIsRoomForAreRefused) {
  SKIP_WITHOUT_DEVICE();
  Scene scene = on_incline(0, 0.3);
  scene.environment.obstacles.resize(most_obstacles + 1, {Plane{}});
  EXPECT_THROW(BatchReplay(scene.plan, {for_device(scene)}, settings_of(1, 1e-3)), std::invalid_argument);
}

}  // namespace
}  // namespace flash::sim::cuda
#endif
