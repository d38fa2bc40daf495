#pragma once
#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "sim/cuda/batch_replay.h"
#include "sim/cuda/hold_motion.h"
#include "sim/newton/solver.h"
#include "tests/sim/cuda/replayed_steps.h"
#include "tests/sim/sheet_scene.h"

/// Sheets on obstacles, and their motions by the processor.
namespace flash::sim::cuda::contact_scenes {

using data::Points;
using Eigen::Isometry3d;
using Eigen::Vector3d;

struct Scene {
  std::string name;
  std::shared_ptr<const SheetPlan> plan;
  Environment environment;
  int steps;
};

inline std::shared_ptr<const SheetPlan> sheet(int cells = 10) {
  return make_sheet_plan(small_sheet(cells, 0.02 * cells));
}

/// A sheet `height` above the plane z = 0, not quite flat: flat ones stand in equilibrium under compression.
inline Environment above(const SheetPlan& plan, double height) {
  Environment environment = environment_of(plan.sheet);
  Points& x = environment.state.positions;
  for (int i = 0; i < x.rows(); ++i) x(i, 2) = height + 1e-4 * (1 + std::sin(20 * x(i, 0) + 30 * x(i, 1)));
  environment.materials[0].membrane_stiffness = 60;
  environment.materials[0].bending_rigidity = 5e-5;
  environment.materials[0].areal_density = 0.2;
  environment.materials[0].friction = 0.3;
  return environment;
}

inline Vector3d middle_of(const SheetPlan& plan) { return plan.sheet.rest.vertices.colwise().mean(); }

inline data::Trajectory path(const std::vector<double>& times, const std::vector<Isometry3d>& poses) {
  return {times, poses};
}

inline Isometry3d moved(const Vector3d& by, double angle = 0) {
  return Eigen::Translation3d(by) * Eigen::AngleAxisd(angle, Vector3d::UnitY());
}

/// On a sheet of 0.2 m with so many cells along a side.
inline std::vector<Scene> scenes(int cells = 10) {
  std::vector<Scene> scenes;
  const auto plan = make_sheet_plan(small_sheet(cells, 0.2));
  const Vector3d middle = middle_of(*plan);
  const auto add = [&](std::string name, double height, int steps,
                       const std::function<void(Environment&)>& change) {
    Scene scene{std::move(name), plan, above(*plan, height), steps};
    change(scene.environment);
    scenes.push_back(scene);
  };
  const auto lift = [cells](Environment& e) {
    e.holds.push_back(
        gripped(e, {0, 1, cells + 1, cells + 2}, straight_path(Vector3d::Zero(), {0.03, 0.03, 0.06}, 0.25)));
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

inline Trajectory by_processor(const Scene& scene, double tolerance, int stale_factor_solves = 0) {
  Environment environment = scene.environment;
  Solver solver(scene.plan,
                {.time_step = time_step, .tolerance = tolerance, .stale_factor_solves = stale_factor_solves});
  Trajectory trajectory;
  for (int k = 0; k < scene.steps; ++k) {
    const StepReport report = solver.step(environment);
    trajectory.positions.push_back(environment.state.positions);
    for (const Vector3d& force : report.hold_forces) trajectory.forces.push_back(force);
    trajectory.steps.push_back(step_of(report));
  }
  return trajectory;
}

inline ReplayEnvironment for_device(const Scene& scene) {
  Environment environment = scene.environment;
  const auto motion =
      std::make_shared<const HoldMotion>(motion_of_holds(environment, time_step, scene.steps));
  return replay_environment(scene.environment, motion);
}

inline double weight_of(const Scene& scene) {
  return 9.81 * scene.environment.materials[0].areal_density * scene.plan->sheet.vertex_area.sum();
}

inline double size_of(const SheetPlan& plan) {
  const Points& rest = plan.sheet.rest.vertices;
  return (rest.colwise().maxCoeff() - rest.colwise().minCoeff()).norm();
}

/// Steps that both take in the same parts, by the same exits. Beyond them they solve different equations: a
/// step in halves is another discretization, and at a threshold rounding decides whether it is halved, or
/// whether the way out of an obstacle is given up after as many iterations as there may be.
inline std::size_t common_steps(const Trajectory& a, const Trajectory& b) {
  const int most_iterations = SolverSettings{}.max_iterations;
  const auto alike = [most_iterations](const ReplayStep& s, const ReplayStep& t) {
    return s.substeps == t.substeps && (s.iterations < most_iterations) == (t.iterations < most_iterations);
  };
  std::size_t count = 0;
  while (count < a.steps.size() && alike(a.steps[count], b.steps[count])) ++count;
  return count;
}

/// Largest distance of a vertex in the first `steps`, as a share of the sheet's size.
inline double distance(const Scene& scene, const Trajectory& a, const Trajectory& b, std::size_t steps) {
  double largest = 0;
  for (std::size_t k = 0; k < steps; ++k) {
    const double own = (a.positions[k] - b.positions[k]).rowwise().norm().maxCoeff();
    largest = own <= largest ? largest : own;
  }
  return largest / size_of(*scene.plan);
}

/// How far two solutions of a scene may drift apart, as a share of the sheet's size: a residual of the
/// tolerance is an acceleration of so much of gravity, in every step of both.
inline double drift(const Scene& scene, double tolerance) {
  const double time = scene.steps * settings_of(scene.steps, tolerance).time_step;
  return tolerance * 9.81 * time * time / size_of(*scene.plan);
}

/// Steps in which the processor finds one solution, whatever its factors are. A sheet that buckles or folds
/// has several, each as good, and rounding decides which one a solver comes to.
inline std::size_t steps_of_one_solution(const Scene& scene, double tolerance, const Trajectory& processor) {
  std::size_t count = processor.steps.size();
  for (const int stale_factor_solves : {1, 2, 3, 4, 5}) {
    const Trajectory other = by_processor(scene, tolerance, stale_factor_solves);
    count = std::min(count, common_steps(other, processor));
    while (count > 0 && distance(scene, other, processor, count) > drift(scene, tolerance)) --count;
  }
  return count;
}

}  // namespace flash::sim::cuda::contact_scenes
