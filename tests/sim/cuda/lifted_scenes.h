#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "sim/cuda/batch_replay.h"
#include "sim/newton/solver.h"
#include "tests/sim/cuda/meshes.h"
#include "tests/sim/cuda/replayed_steps.h"
#include "tests/sim/sheet_scene.h"

/// Sheets that are lifted or fly, without obstacles, and their motions by the processor.
namespace flash::sim::cuda::lifted_scenes {

using data::Points;
using Eigen::Vector3d;

/// A replay of one environment.
struct Scene {
  std::string name;
  std::shared_ptr<const SheetPlan> plan;
  ReplayEnvironment environment;
  int steps;
};

/// Minimum jerk from 0 to 1 within `duration`.
inline double risen(double time, double duration) {
  const double s = std::min(time / duration, 1.0);
  return s * s * s * (10 + s * (6 * s - 15));
}

/// A sheet that lies in the plane z = 0, not quite flat: flat ones stand in equilibrium under compression.
inline ReplayEnvironment resting(const SheetPlan& plan) {
  ReplayEnvironment environment;
  environment.positions = plan.sheet.rest.vertices;
  for (int i = 0; i < environment.positions.rows(); ++i)
    environment.positions(i, 2) +=
        1e-3 * std::sin(20 * environment.positions(i, 0) + 30 * environment.positions(i, 1));
  environment.velocities = Points::Zero(environment.positions.rows(), 3);
  environment.material.membrane_stiffness = 60;
  environment.material.bending_rigidity = 5e-5;
  environment.material.areal_density = 0.2;
  return environment;
}

/// The vertices nearest to the first corner of the mesh's bounding box.
inline std::vector<int> corner(const SheetPlan& plan, int count) {
  const Points& x = plan.sheet.rest.vertices;
  const Eigen::RowVector3d from = x.colwise().minCoeff();
  std::vector<int> order(static_cast<std::size_t>(x.rows()));
  for (int i = 0; i < x.rows(); ++i) order[static_cast<std::size_t>(i)] = i;
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) {
    return (x.row(a) - from).squaredNorm() < (x.row(b) - from).squaredNorm();
  });
  order.resize(static_cast<std::size_t>(count));
  return order;
}

using Way = std::function<Vector3d(double)>;  ///< displacement by time

inline std::shared_ptr<const HoldMotion> carried(const ReplayEnvironment& environment,
                                                 const std::vector<int>& held, int steps, const Way& way,
                                                 std::array<bool, 3> axes = {true, true, true}) {
  auto motion = std::make_shared<HoldMotion>();
  for (int k = 1; k <= steps; ++k) {
    motion->emplace_back();
    for (const int vertex : held)
      motion->back().push_back(
          {vertex, axes, environment.positions.row(vertex).transpose() + way(k * time_step)});
  }
  return motion;
}

inline Way lift(double height, double duration) {
  return [=](double time) { return Vector3d(0, 0, height * risen(time, duration)); };
}

inline std::shared_ptr<const SheetPlan> grid() { return small_plans()[2].second; }

/// A lift by a corner with each membrane, and each bending model with and without both dampings.
inline std::vector<Scene> scenes() {
  std::vector<Scene> scenes;
  const auto add = [&](std::string name, const std::shared_ptr<const SheetPlan>& plan,
                       const std::function<void(ReplayEnvironment&)>& change) {
    Scene scene{std::move(name), plan, resting(*plan), 30};
    scene.environment.holds = carried(scene.environment, corner(*plan, 3), scene.steps, lift(0.05, 0.25));
    change(scene.environment);
    scenes.push_back(scene);
  };
  using data::BendingModel;
  using data::Constitutive;
  const auto plan = grid();
  for (const auto& [name, law] :
       {std::pair{"corotated", Constitutive::tri_corotated}, std::pair{"arap", Constitutive::tri_arap},
        std::pair{"stvk", Constitutive::tri_stvk}, std::pair{"neohookean", Constitutive::tri_neohookean}})
    add(name, plan, [law = law](ReplayEnvironment& e) { e.material.constitutive = law; });
  for (const auto& [name, model] :
       {std::pair{"plate", BendingModel::plate}, std::pair{"isometric", BendingModel::isometric},
        std::pair{"hinge", BendingModel::hinge}}) {
    add(name, plan, [model = model](ReplayEnvironment& e) { e.material.bending_model = model; });
    add(std::string(name) + ", damped", plan, [model = model](ReplayEnvironment& e) {
      e.material.bending_model = model;
      e.material.stiffness_damping = 0.02;
      e.material.air_drag = 0.5;
    });
  }
  add("arap, damped", plan, [](ReplayEnvironment& e) {
    e.material.constitutive = Constitutive::tri_arap;
    e.material.stiffness_damping = 0.05;
  });
  add("Delaunay, swinging", small_plans()[3].second, [](ReplayEnvironment& e) {
    e.material.air_drag = 1;
    for (int i = 0; i < e.velocities.rows(); ++i) e.velocities.row(i) << 0.3, 0, 0.5 * e.positions(i, 0);
  });
  add("disc with a load, one axis free", small_plans()[4].second, [](ReplayEnvironment& e) {
    e.loads.push_back({7, {0.002, 0.001, -0.003}});
    std::vector<int> held;
    for (const HeldVertex& one : e.holds->front()) held.push_back(one.vertex);
    e.holds = carried(e, held, 30, lift(0.02, 0.2), {false, true, true});
  });
  add("held in nothing, far from the origin", plan, [](ReplayEnvironment& e) {
    e.holds = nullptr;
    e.positions.rowwise() += Eigen::RowVector3d(3, -2, 5);
    for (int i = 0; i < e.velocities.rows(); ++i) e.velocities(i, 2) = 0.2 * std::sin(0.3 * i);
  });
  return scenes;
}

struct Trajectory {
  std::vector<Points> positions;  ///< after each step
  std::vector<ReplayStep> steps;
};

inline Trajectory by_processor(const Scene& scene, double tolerance) {
  Environment environment;
  environment.materials[0] = scene.environment.material;
  environment.gravity = scene.environment.gravity;
  environment.loads = scene.environment.loads;
  environment.state.positions = scene.environment.positions;
  environment.state.velocities = scene.environment.velocities;
  Solver solver(scene.plan, {.time_step = time_step, .tolerance = tolerance, .stale_factor_solves = 0});
  Trajectory trajectory;
  for (int k = 0; k < scene.steps; ++k) {
    environment.holds.clear();
    environment.state.held.clear();
    if (scene.environment.holds != nullptr)
      for (const HeldVertex& held : (*scene.environment.holds)[static_cast<std::size_t>(k)])
        environment.holds.push_back(support(held.vertex, held.axes, held.target));
    const StepReport report = solver.step(environment);
    trajectory.positions.push_back(environment.state.positions);
    trajectory.steps.push_back(step_of(report));
  }
  return trajectory;
}

/// Largest distance of a vertex at any time, as a share of the sheet's size.
inline double distance(const Scene& scene, const Trajectory& a, const Trajectory& b) {
  const Points& rest = scene.plan->sheet.rest.vertices;
  const double size = (rest.colwise().maxCoeff() - rest.colwise().minCoeff()).norm();
  double largest = 0;
  for (std::size_t k = 0; k < a.positions.size(); ++k) {
    const double own = (a.positions[k] - b.positions[k]).rowwise().norm().maxCoeff();
    largest = own <= largest ? largest : own;
  }
  return largest / size;
}

}  // namespace flash::sim::cuda::lifted_scenes
