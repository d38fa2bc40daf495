// Batches by the projective method.
#include <gtest/gtest.h>

#include "sim/batch.h"
#include "tests/sim/sheet_scene.h"

namespace flash::sim {
namespace {

constexpr int steps = 30;

/// The published budget: five local-global iterations, none fewer, up to ten of contact.
BatchSettings published_budget() {
  BatchSettings settings;
  settings.projective.emplace();
  settings.projective->iterations = 5;
  settings.projective->tolerance = 1e-15;
  settings.projective->acceleration = 0;
  settings.projective->metric = ContactMetric::inertia;
  settings.projective->constraints.iterations = 10;
  settings.projective->constraints.tolerance = 1e-9;
  settings.steps = steps;
  return settings;
}

Environment soft(const SheetPlan& plan) {
  Environment environment = environment_of(plan.sheet);
  environment.materials[0].membrane_stiffness = 60;
  environment.materials[0].bending_rigidity = 5e-5;
  environment.materials[0].areal_density = 0.2;
  environment.materials[0].friction = 0.3;
  environment.materials[0].bending_model = data::BendingModel::isometric;
  return environment;
}

Environment hanging(const SheetPlan& plan) {
  Environment environment = soft(plan);
  environment.holds = {{.vertices = {0, 1, 9}}};
  return environment;
}

Environment on_a_plane(const SheetPlan& plan) {
  Environment environment = soft(plan);
  environment.obstacles = {{Plane{}}};
  environment.state.positions.col(2).array() += 2e-3;
  environment.state.velocities.rowwise() = Eigen::RowVector3d(0.3, 0.1, 0);
  return environment;
}

/// A grasp that closes and opens again.
Environment grasped(const SheetPlan& plan) {
  Environment environment = soft(plan);
  environment.obstacles = {{Plane{}}};
  Hold grasp = gripped(environment, {0, 1, 9}, straight_path({0, 0, -0.01}, {0.02, 0.02, 0.06}, 0.3));
  grasp.from = 0.05;
  grasp.to = 0.2;
  grasp.closing_time = 0.03;
  environment.holds = {grasp};
  return environment;
}

TEST(ProjectiveBatch, IsThatOfTheSolver) {
  const auto plan = make_sheet_plan(small_sheet(8, 0.16));
  const BatchSettings settings = published_budget();
  for (const Environment& environment : {hanging(*plan), on_a_plane(*plan), grasped(*plan)}) {
    Batch batch(plan, {environment}, settings);
    batch.advance(steps);
    Environment own = environment;
    ProjectiveSolver solver(plan, *settings.projective);
    for (int k = 0; k < steps; ++k) {
      const ProjectiveReport report = solver.step(own);
      EXPECT_EQ(batch.stats(0)[k].residual, report.residual);
      EXPECT_EQ(batch.stats(0)[k].iterations, report.iterations);
    }
    EXPECT_EQ(batch.state(0).positions, own.state.positions);
  }
}

}  // namespace
}  // namespace flash::sim
