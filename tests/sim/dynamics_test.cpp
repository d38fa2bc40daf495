// Closed forms of implicit Euler that any solver of it must show.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "sim/batch.h"
#include "tests/sim/sheet_scene.h"
#include "tests/sim/sliding_mass.h"

namespace flash::sim {
namespace {

using Eigen::RowVector3d;
using Eigen::Vector3d;

constexpr double g = 9.81;

TEST(Dynamics, FreeFallFollowsTheDiscreteLaw) {
  const Sheet sheet = small_sheet();
  for (const double h : {0.01, 0.001}) {
    Environment environment = environment_of(sheet);
    const RowVector3d velocity(0.3, -0.2, 1.0);
    environment.state.velocities.rowwise() = velocity;
    Solver solver(sheet, {.time_step = h, .tolerance = 1e-12});
    const int steps = 50;
    for (int n = 0; n < steps; ++n) solver.step(environment);
    // x_n = x_0 + v_0 t + g h^2 n (n + 1) / 2
    const RowVector3d moved =
        velocity * (steps * h) + RowVector3d(0, 0, -g) * (h * h * steps * (steps + 1) / 2);
    const data::Points expected = sheet.rest.vertices.rowwise() + moved;
    EXPECT_LT((environment.state.positions - expected).cwiseAbs().maxCoeff(), 1e-11);
  }
}

// What the bending of a clamped patch is rounded by is more than what the first step of a gentle lift takes.
TEST(Dynamics, AMicrometreIsAStepOfAFineMeshToo) {
  Sheet sheet = make_sheet(data::rectangle({.width = 0.2,
                                            .height = 0.025,
                                            .cells_x = 128,
                                            .cells_y = 16,
                                            .pattern = data::DiagonalPattern::alternating_by_row}));
  Environment environment = environment_of(sheet);
  data::SheetMaterial& material = environment.materials[0];
  material.membrane_stiffness = 16.6;
  material.bending_rigidity = 7.66e-5;
  material.friction = 0.19;
  environment.obstacles.push_back({Plane{}});
  std::vector<data::Trajectory> gripper(1);
  for (const double t : {0.0, 0.01}) {
    gripper[0].times.push_back(t);
    gripper[0].poses.push_back(Eigen::Isometry3d(Eigen::Translation3d(1.15e-4 * t * Vector3d(-0.5, 0, 1))));
  }
  environment.schedule = make_schedule(gripper, 0.0, 0.01, 1);
  Hold end{.name = "gripper", .frame = 0};
  for (int i = 0; i < int(sheet.rest.vertices.rows()); ++i)
    if (sheet.rest.vertices(i, 0) > 0.15) end.vertices.push_back(i);
  for (RestTriangle& triangle : sheet.triangles)
    triangle.stiff = std::all_of(triangle.vertices.begin(), triangle.vertices.end(),
                                 [&](int i) { return sheet.rest.vertices(i, 0) > 0.15; });
  environment.holds.push_back(end);
  const auto plan = make_sheet_plan(sheet);
  for (const double angle : {0.1, 0.3, 0.5, 0.7, 0.9, 1.1}) {
    const Eigen::Matrix3d turn = Eigen::AngleAxisd(angle, Vector3d::UnitZ()).toRotationMatrix();
    Environment turned = environment;
    turned.state.positions = sheet.rest.vertices * turn.transpose();
    turned.state.positions.rowwise() += RowVector3d(0.4, 0.3, 0);
    Solver solver(plan, {.time_step = 0.01});
    const StepReport report = solver.step(turned);
    EXPECT_TRUE(report.converged);
    EXPECT_EQ(report.substeps, 1);
  }
}

TEST(Dynamics, AirDragFollowsTheDiscreteLaw) {
  const Sheet sheet = small_sheet();
  Environment environment = environment_of(sheet);
  environment.gravity.setZero();
  environment.materials[0].air_drag = 2.0;
  environment.state.velocities.col(0).setOnes();
  Solver solver(sheet, {.tolerance = 1e-12});
  for (int n = 0; n < 30; ++n) solver.step(environment);
  EXPECT_NEAR(environment.state.velocities(0, 0), std::pow(1 + 2.0 * 0.01, -30), 1e-10);
}

/// Velocity of the tangential slide on a plane tilted by `angle`, from the rotated gravity.
Environment on_incline(const Sheet& sheet, double angle, double tangent_direction, double friction) {
  Environment environment = environment_of(sheet);
  environment.materials[0].friction = friction;
  environment.gravity = g * Vector3d(std::sin(angle) * std::cos(tangent_direction),
                                     std::sin(angle) * std::sin(tangent_direction), -std::cos(angle));
  environment.obstacles.push_back({Plane{}});
  return environment;
}

class Incline : public testing::TestWithParam<double> {};

TEST_P(Incline, SticksBelowTheConeAndSlidesAboveIt) {
  const Sheet sheet = small_sheet();
  const double direction = GetParam(), friction = 0.3, h = 0.01;
  const int steps = 100;
  for (const double offset : {-0.001, -0.0001, 0.0001, 0.001}) {
    const double angle = std::atan(friction + offset);
    Environment environment = on_incline(sheet, angle, direction, friction);
    Solver solver(sheet, {.time_step = h, .tolerance = 1e-10});
    for (int n = 0; n < steps; ++n) EXPECT_TRUE(solver.step(environment).converged);
    const data::Points moved = environment.state.positions - sheet.rest.vertices;
    if (offset < 0) {
      // Bristles bend by their length. The speed that is left then, length / h, is braked by the rest of
      // friction.
      const double longest = bristle_length(h), speed = longest / h,
                   braking = g * (friction * std::cos(angle) - std::sin(angle));
      EXPECT_LE(moved.cwiseAbs().maxCoeff(), longest + 0.5 * speed * speed / braking);
      EXPECT_LE(environment.state.velocities.cwiseAbs().maxCoeff(), 1e-12);
    } else {
      const double expected = slide_down(angle, friction, g, h, steps).place;
      const Eigen::VectorXd along = moved.col(0) * std::cos(direction) + moved.col(1) * std::sin(direction);
      // Of the weight 30 times the tolerance may be missing.
      const double seconds = h * steps;
      EXPECT_LT((along.array() - expected).abs().maxCoeff(), 0.5 * 3e-9 * g * seconds * seconds);
      EXPECT_EQ(moved.col(2).cwiseAbs().maxCoeff(), 0.0);
    }
  }
}

// A linear problem is solved to three tenths of what is missing, at worst.
constexpr double linear_share = 0.3;

TEST_P(Incline, SlidesAboveTheConeAtTheDefaultToleranceToo) {
  const Sheet sheet = small_sheet();
  const double direction = GetParam(), h = 0.01;
  const int steps = 100;
  for (const double friction : {0.3, 1.0}) {
    const double angle = std::atan(friction + 0.001);
    Environment environment = on_incline(sheet, angle, direction, friction);
    Solver solver(sheet, {.time_step = h});
    for (int n = 0; n < steps; ++n) EXPECT_TRUE(solver.step(environment).converged);
    const data::Points moved = environment.state.positions - sheet.rest.vertices;
    const double expected =
        g * (std::sin(angle) - friction * std::cos(angle)) * h * h * steps * (steps + 1) / 2;
    const Eigen::VectorXd along = moved.col(0) * std::cos(direction) + moved.col(1) * std::sin(direction);
    EXPECT_NEAR(along.mean(), expected, linear_share * expected);
  }
}

TEST(Dynamics, AForceBelowTheToleranceMovesTheSheetAllTheSame) {
  const Sheet sheet = small_sheet();
  constexpr double h = 0.01, share = 5e-4;  // of the weight, half of the tolerance
  const int steps = 100;
  Environment environment = environment_of(sheet);
  environment.gravity = Vector3d(share * g, 0, -g);
  environment.materials[0].friction = 0;
  environment.obstacles.push_back({Plane{}});
  Solver solver(sheet, {.time_step = h});
  for (int n = 0; n < steps; ++n) EXPECT_TRUE(solver.step(environment).converged);
  const double expected = share * g * h * h * steps * (steps + 1) / 2;
  const data::Points moved = environment.state.positions - sheet.rest.vertices;
  EXPECT_NEAR(moved.col(0).mean(), expected, linear_share * expected);
}

INSTANTIATE_TEST_SUITE_P(TangentBases, Incline, testing::Values(0.0, M_PI / 4));

TEST(Dynamics, EachEnvironmentHasItsOwnFriction) {
  const Sheet sheet = small_sheet(4, 0.08);
  std::vector<Environment> environments;
  const double angle = std::atan(0.3);
  for (const double friction : {0.299, 0.301}) environments.push_back(on_incline(sheet, angle, 0, friction));
  Batch batch(make_sheet_plan(sheet), environments, {.solver = {.tolerance = 1e-10}, .steps = 50});
  batch.advance(50);
  EXPECT_GT(batch.state(0).positions(0, 0) - sheet.rest.vertices(0, 0), 1e-4);
  EXPECT_LE(batch.state(1).positions(0, 0) - sheet.rest.vertices(0, 0), 2 * bristle_length(0.01));
}

TEST(Dynamics, ASlidingSheetStopsAfterTheDiscreteDistance) {
  const Sheet sheet = small_sheet();
  const double h = 0.01, friction = 0.3;
  Environment environment = on_incline(sheet, 0, 0, friction);
  environment.state.velocities.col(0).setOnes();
  Solver solver(sheet, {.time_step = h, .tolerance = 1e-10});
  double expected = 0;
  for (double v = 1 - h * friction * g; v > 0; v -= h * friction * g) expected += h * v;
  for (int n = 0; n < 60; ++n) solver.step(environment);
  const Eigen::VectorXd moved = environment.state.positions.col(0) - sheet.rest.vertices.col(0);
  EXPECT_LT((moved.array() - expected).abs().maxCoeff(), 1e-6);
  EXPECT_LT(environment.state.velocities.cwiseAbs().maxCoeff(), 1e-9);
}

TEST(Dynamics, InternalForcesNeitherPushNorTurn) {
  // Free sheet, no gravity, stretched at the start. sum m dv = 0 and, the forces being those at the end of
  // the step, sum x_(n+1) x m dv = 0.
  const Sheet sheet = small_sheet();
  Environment environment = environment_of(sheet);
  environment.gravity.setZero();
  environment.state.positions *= 1.05;
  environment.state.positions(3, 2) += 0.004;
  Solver solver(sheet, {.tolerance = 1e-12});
  for (int n = 0; n < 20; ++n) {
    const data::Points before = environment.state.velocities;
    solver.step(environment);
    const data::Points gained = sheet.vertex_area.asDiagonal() * (environment.state.velocities - before);
    RowVector3d turn = RowVector3d::Zero();
    double scale = 0;
    for (int i = 0; i < gained.rows(); ++i) {
      const RowVector3d x = environment.state.positions.row(i), p = gained.row(i);
      turn += x.cross(p);
      scale += x.norm() * p.norm();
    }
    EXPECT_LT(gained.colwise().sum().norm(), 1e-9 * gained.norm());
    EXPECT_LT(turn.norm(), 1e-9 * scale);
  }
}

TEST(Dynamics, AnUnconvergedStepSaysSo) {
  const Sheet sheet = small_sheet();
  Environment environment = environment_of(sheet);
  environment.holds.push_back(support(0, {true, true, true}, sheet.rest.vertices.row(0)));
  environment.state.velocities.setRandom();
  Solver solver(sheet, {.max_iterations = 1, .tolerance = 1e-12});
  EXPECT_FALSE(solver.step(environment).converged);
}

}  // namespace
}  // namespace flash::sim
