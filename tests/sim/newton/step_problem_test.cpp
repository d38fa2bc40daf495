#include "sim/newton/step_problem.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>
#include <utility>

#include "tests/sim/sheet_scene.h"
#include "tests/sim/solid_scene.h"

namespace flash::sim {
namespace {

using data::Points;

/// The largest entry on the diagonal of the stiffness, by central differences of forces [N/m].
double measured_stiffness(const SheetPlan& plan, const Environment& environment, double h) {
  const StepProblem problem(plan, environment, h, {.speed = 1});
  const double way = 1e-7;
  double largest = 0;
  Iterate at;
  for (Eigen::Index i = 0; i < environment.state.positions.rows(); ++i)
    for (int c = 0; c < 3; ++c) {
      double ends[2];
      for (const int side : {0, 1}) {
        at.positions = environment.state.positions;
        at.positions(i, c) += side == 0 ? -way : way;
        Points carried = at.positions;
        at.contacts = begin_step(problem.contacts, carried);
        problem.evaluate(at);
        ends[side] = at.force(i, c);
      }
      largest = std::max(largest, (ends[1] - ends[0]) / (2 * way) - problem.potential.mass()[i] / (h * h));
    }
  return largest;
}

/// That of the plan is no less than what was measured, but for `share`, and no more than `most` times it.
void expect_near(const SheetPlan& plan, const Environment& environment, double share, double most) {
  constexpr double h = 0.01;
  const double measured = measured_stiffness(plan, environment, h),
               own = largest_stiffness(body_laws(plan, environment).front(), h);
  EXPECT_GE(own, share * measured);
  EXPECT_LE(own, most * measured);
}

// A vertex moved by d is pulled back by no more than (lambda + 2 mu) sum A |grad N|^2 d; the isotropic part,
// mu of it, is felt along any axis.
TEST(StepProblem, KnowsTheLargestStiffnessOfASheet) {
  const auto plan = make_sheet_plan(small_sheet());
  for (const auto bending :
       {data::BendingModel::isometric, data::BendingModel::plate, data::BendingModel::hinge}) {
    SCOPED_TRACE(static_cast<int>(bending));
    Environment environment = environment_of(plan->sheet);
    data::SheetMaterial& material = environment.materials[0];
    material.bending_model = bending;
    material.membrane_stiffness = 100;
    material.bending_rigidity = 1e-9;
    expect_near(*plan, environment, 1, 2.5);
    material.stiffness_damping = 0.05;
    expect_near(*plan, environment, 1, 2.5);
    material.stiffness_damping = 0;
    material.membrane_stiffness = 1e-6;
    material.bending_rigidity = 1;
    expect_near(*plan, environment, 0.9, 4);
  }
}

TEST(StepProblem, KnowsTheLargestStiffnessOfASolid) {
  for (const auto order : {data::ElementOrder::linear, data::ElementOrder::quadratic}) {
    SCOPED_TRACE(static_cast<int>(order));
    const auto plan = make_sheet_plan(solid_box({0.1, 0.05, 0.03}, {4, 2, 2}, order));
    const Environment environment = solid_environment(plan->sheet, {.youngs_modulus = 1e6});
    expect_near(*plan, environment, 1, 3);
  }
}

/// A step of a plate of steel, 20 mm thick on cells of 10 mm, to a tolerance below the rounding of its
/// forces.
StepReport step_of_steel(const Eigen::Vector3d& place, double gravity) {
  const auto plan = make_sheet_plan(small_sheet(12));
  Environment environment = environment_of(plan->sheet);
  environment.state.positions.rowwise() += place.transpose();
  environment.gravity = {0, 0, -gravity};
  constexpr double thickness = 0.02, young = 2.1e11, density = 7800;
  data::SheetMaterial& material = environment.materials[0];
  material.bending_model = data::BendingModel::plate;
  material.membrane_stiffness = young * thickness;
  material.bending_rigidity = young * std::pow(thickness, 3) / 12 / (1 - 0.09);
  material.areal_density = density * thickness;
  environment.holds = {{.vertices = {0, 1, 2, 13, 14, 15}}};
  Solver solver(plan, {.time_step = 0.005, .max_iterations = 50, .tolerance = 1e-8, .halvings = 0});
  return solver.step(environment);
}

TEST(StepProblem, AStepEndsWhereRoundingIsAllThatIsLeft) {
  for (const double gravity : {0.0, 9.81}) {
    const StepReport report = step_of_steel({0, 0, 0}, gravity);
    EXPECT_LE(report.iterations, 20);
    EXPECT_TRUE(report.converged);
    EXPECT_GT(report.residual, 1e-8);  // which no step can reach
    EXPECT_LE(report.residual, 1.1e-5);
  }
}

// Where rounding is no longer small beside the weight, no step is called solved for it: far from the origin.
TEST(StepProblem, WhatRoundsToMoreThanItsShareOfTheWeightIsNotSolved) {
  EXPECT_FALSE(step_of_steel({3000, -2000, 1000}, 9.81).converged);
}

// A plate far from the origin, whose forces round to more than its weight, may miss the tolerance by a
// hundredth of it.
TEST(StepProblem, RoundingCountsUpToAHundredthOfTheWeight) {
  const auto plan = make_sheet_plan(small_sheet());
  Environment environment = environment_of(plan->sheet);
  environment.gravity = {0, 0, -9.81};
  environment.state.positions.rowwise() += Eigen::RowVector3d(1e5, 0, 0);
  environment.materials[0].membrane_stiffness = 1e9;
  const StepProblem problem(*plan, environment, 0.01, {.speed = 1});
  Iterate iterate;
  iterate.positions = environment.state.positions;
  iterate.contacts = begin_step(problem.contacts, iterate.positions);
  problem.evaluate(iterate);
  const auto misses = [&](double share) {
    iterate.residual.setZero();
    iterate.residual.col(2) = share * 9.81 * problem.potential.mass();
    return !problem.balanced(iterate, 1e-3);
  };
  EXPECT_FALSE(misses(0.0109));
  EXPECT_TRUE(misses(0.0111));
  EXPECT_FALSE(problem.rests(iterate, 1e-3));
}

/// A square sheet with a sliver so high at the middle of an edge [m].
std::shared_ptr<const SheetPlan> sheet_with_sliver(int cells, double side, double height) {
  data::TriangleMesh mesh = small_sheet(cells, side).rest;
  const int left = cells * (cells + 1) + cells / 2, tip = static_cast<int>(mesh.vertices.rows());
  mesh.vertices.conservativeResize(tip + 1, 3);
  mesh.vertices.row(tip) =
      0.5 * (mesh.vertices.row(left) + mesh.vertices.row(left + 1)) + Eigen::RowVector3d(0, height, 0);
  mesh.triangles.conservativeResize(mesh.triangles.rows() + 1, 3);
  mesh.triangles.row(mesh.triangles.rows() - 1) << left, left + 1, tip;
  return make_sheet_plan(make_sheet(mesh));
}

// A sheet that slides freely on a table by less than the tolerance, over n steps of h: a h^2 n (n + 1) / 2.
// Single precision loses the inertia of the stiff ones beside their stiffness.
TEST(StepProblem, ForcesBelowTheToleranceMoveWhatIsStiff) {
  constexpr double h = 0.05, slope = 9e-4, side = 0.12;
  constexpr int steps = 40;
  data::SheetMaterial steel, paper, towel;
  steel.membrane_stiffness = 2.1e8, steel.bending_rigidity = 19.2, steel.areal_density = 7.8;
  paper.membrane_stiffness = 3e5, paper.bending_rigidity = 2.7e-4, paper.areal_density = 0.08;
  towel.membrane_stiffness = 50, towel.bending_rigidity = 1e-4, towel.areal_density = 0.2;
  const auto even = make_sheet_plan(small_sheet(12, side)), sliver = sheet_with_sliver(12, side, 1e-6);
  for (const auto& [plan, given] : {std::pair(even, steel), {even, paper}, {sliver, towel}}) {
    SCOPED_TRACE(given.membrane_stiffness);
    Environment environment = environment_of(plan->sheet);
    environment.gravity = {slope * 9.81, 0, -9.81};
    environment.materials[0] = given;
    environment.materials[0].friction = 0;
    environment.obstacles.push_back({Plane{}});
    const double start = environment.state.positions.col(0).mean();
    Solver solver(plan, {.time_step = h});
    for (int k = 0; k < steps; ++k) EXPECT_TRUE(solver.step(environment).converged) << k;
    const double expected = slope * 9.81 * h * h * steps * (steps + 1) / 2;
    EXPECT_NEAR(environment.state.positions.col(0).mean() - start, expected, 1e-2 * expected);
  }
}

// Nor on a mesh whose largest entry is that of a sliver: a towel that hangs from its edge moves, or it is
// said.
TEST(StepProblem, ASliverDoesNotLetASheetStandStill) {
  constexpr int cells = 20;
  const auto plan = sheet_with_sliver(cells, 0.3, 1e-9);
  for (const auto bending : {data::BendingModel::isometric, data::BendingModel::hinge}) {
    SCOPED_TRACE(static_cast<int>(bending));
    Environment environment = environment_of(plan->sheet);
    environment.gravity = {0, 0, -9.81};
    environment.materials[0].membrane_stiffness = 50;
    environment.materials[0].bending_rigidity = 1e-4;
    environment.materials[0].bending_model = bending;
    Hold edge;
    for (int i = 0; i <= cells; ++i) edge.vertices.push_back(i);
    environment.holds = {edge};
    Solver solver(plan, {.time_step = 0.01, .halvings = 0});
    const StepReport report = solver.step(environment);
    EXPECT_TRUE(!report.converged || report.residual <= 1.1e-3) << report.residual;
  }
}

// A cloth's rounding is far below all that is asked of it: nothing changes there.
TEST(StepProblem, ACapOnRoundingIsFarBelowATolerance) {
  const auto plan = make_sheet_plan(small_sheet());
  Environment environment = environment_of(plan->sheet);
  environment.state.positions.rowwise() += Eigen::RowVector3d(1, 1, 1);
  environment.materials[0].membrane_stiffness = 1000;
  environment.materials[0].bending_rigidity = 1e-3;
  const StepProblem problem(*plan, environment, 0.01, {.speed = 1});
  const double least_weight = problem.potential.mass().minCoeff() * 9.81;
  EXPECT_LT(std::numeric_limits<double>::epsilon() * 2 * problem.stiffnesses[0], 1e-7 * least_weight);
}

}  // namespace
}  // namespace flash::sim
