// Sheets whose bending yields: what stays bent, what is lost, and how that follows the time step.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "data/files/error.h"
#include "sim/device_limits.h"
#include "tests/sim/sheet_scene.h"

namespace flash::sim {
namespace {

constexpr double cell = 0.01, rigidity = 1e-3;

/// A strip of square cells along x, one cell wide.
Sheet strip(int cells) {
  return make_sheet(data::rectangle({.width = cells * cell, .height = cell, .cells_x = cells, .cells_y = 1}));
}

Environment yielding_environment(const Sheet& sheet, double yield_curvature) {
  Environment environment = environment_of(sheet);
  environment.gravity.setZero();
  data::SheetMaterial& material = environment.materials[0];
  material.bending_model = data::BendingModel::hinge;
  material.bending_rigidity = rigidity;
  material.membrane_stiffness = 1000;
  material.yield_curvature = yield_curvature;
  return environment;
}

/// The strip bent up without strain: flat cells, each turned against the last by curvature times cell.
data::Points bent(const Sheet& sheet, double curvature) {
  data::Points x = sheet.rest.vertices;
  for (Eigen::Index i = 0; i < x.rows(); ++i) {
    const int column = static_cast<int>(std::lround(x(i, 0) / cell));
    double along = 0, up = 0;
    for (int k = 0; k < column; ++k) {
      along += cell * std::cos(k * curvature * cell);
      up += cell * std::sin(k * curvature * cell);
    }
    x(i, 0) = along;
    x(i, 2) = up;
  }
  return x;
}

void hold_all(const data::Points& at, Environment& environment) {
  Hold hold;
  for (int i = 0; i < static_cast<int>(at.rows()); ++i) hold.vertices.push_back(i);
  hold.targets = at;
  environment.holds = {hold};
  environment.state.held.clear();
}

/// Angles between the cells of a strip, and across their diagonals.
struct StripAngles {
  std::vector<double> across, diagonal;
};

StripAngles angles_of(const Sheet& sheet, const data::Points& positions) {
  StripAngles angles;
  for (const Hinge& hinge : sheet_hinges(sheet)) {
    HingePositions x;
    for (int k = 0; k < 4; ++k) x.col(k) = positions.row(hinge.vertices[k]);
    const Eigen::RowVector3d edge =
        sheet.rest.vertices.row(hinge.vertices[1]) - sheet.rest.vertices.row(hinge.vertices[0]);
    (std::abs(edge.x()) < 1e-9 ? angles.across : angles.diagonal).push_back(hinge_angle(x));
  }
  return angles;
}

TEST(Yielding, AStripBentBeyondItKeepsTheCurvatureLessThatAtWhichItYields) {
  constexpr double yields_at = 10, bent_to = 35;
  constexpr int cells = 8;
  const Sheet sheet = strip(cells);
  Environment environment = yielding_environment(sheet, yields_at);
  environment.materials[0].air_drag = 50;
  Solver solver(sheet, {.time_step = 0.01, .max_iterations = 200, .tolerance = 1e-9});
  hold_all(bent(sheet, bent_to), environment);
  const StepReport held = solver.step(environment);
  // The moment stands at D kappa_y: energy D kappa_y^2 / 2 over the area that bends, one cell for each of the
  // cells - 1 hinges; D kappa_y (kappa - kappa_y) over the same area is lost.
  const double area = (cells - 1) * cell * cell;
  EXPECT_NEAR(held.bending, 0.5 * rigidity * yields_at * yields_at * area, 1e-9 * held.bending);
  EXPECT_NEAR(held.yielding, rigidity * yields_at * (bent_to - yields_at) * area, 1e-9 * held.yielding);

  environment.holds.clear();
  environment.state.velocities.setZero();
  double lost = 0;
  for (int k = 0; k < 200; ++k) {
    const StepReport report = solver.step(environment);
    EXPECT_TRUE(report.converged) << k;
    EXPECT_GE(report.yielding, 0);
    lost += report.yielding;
  }
  EXPECT_EQ(lost, 0);  // it springs back, and drag leaves nothing to yield the other way
  const StripAngles left = angles_of(sheet, environment.state.positions);
  ASSERT_EQ(left.across.size(), static_cast<std::size_t>(cells - 1));
  // At rest every angle is the rest angle. The slowest bending takes 250 rad/s: a step of 0.01 s leaves 0.4
  // of it.
  for (const double angle : left.across) EXPECT_NEAR(std::abs(angle), (bent_to - yields_at) * cell, 1e-5);
  for (const double angle : left.diagonal) EXPECT_NEAR(angle, 0, 1e-5);
}

/// A strip held at one end that falls under its weight for a while.
State fallen(double yield_curvature, int steps, double* lost = nullptr) {
  const Sheet sheet = strip(12);
  Environment environment = yielding_environment(sheet, yield_curvature);
  environment.gravity = {0, 0, -9.81};
  Hold hold;
  for (int i = 0; i < sheet.rest.vertices.rows(); ++i)
    if (sheet.rest.vertices(i, 0) < 1.5 * cell) hold.vertices.push_back(i);
  environment.holds = {hold};
  Solver solver(sheet, {.time_step = 0.01});
  for (int k = 0; k < steps; ++k) {
    const StepReport report = solver.step(environment);
    EXPECT_TRUE(report.converged) << k;
    EXPECT_GE(report.yielding, 0) << k;
    if (lost) *lost += report.yielding;
  }
  return environment.state;
}

TEST(Yielding, WhatDoesNotYieldMovesAsAnElasticSheetToTheLastBit) {
  const State elastic = fallen(std::numeric_limits<double>::infinity(), 30), far = fallen(1e4, 30);
  EXPECT_TRUE(far.rest_angles.empty());
  EXPECT_EQ(std::memcmp(elastic.positions.data(), far.positions.data(),
                        sizeof(double) * static_cast<std::size_t>(elastic.positions.size())),
            0);
}

TEST(Yielding, TakesEnergyInEveryStepAndNeverGivesItBack) {
  double lost = 0;
  const State state = fallen(5, 60, &lost);
  EXPECT_GT(lost, 0);
  EXPECT_FALSE(state.rest_angles.empty());
  const State elastic = fallen(std::numeric_limits<double>::infinity(), 60);
  EXPECT_LT(state.positions.col(2).minCoeff(), elastic.positions.col(2).minCoeff());
}

/// A flap that falls about its hinge, whose moment is that of an elastic, perfectly plastic spring.
struct Flap {
  double mass, arm, stiffness, limit;  ///< [kg], [m], [N m], [rad]
  double angle = 0, speed = 0, rest = 0;

  double acceleration(double at) const {
    const double moment = stiffness * std::clamp(at - rest, -limit, limit);
    return (mass * 9.81 * arm * std::cos(at) - moment) / (mass * arm * arm);
  }
  /// Runge and Kutta's fourth order.
  void advance(double step) {
    const double a1 = acceleration(angle), v2 = speed + 0.5 * step * a1,
                 a2 = acceleration(angle + 0.5 * step * speed), v3 = speed + 0.5 * step * a2,
                 a3 = acceleration(angle + 0.5 * step * v2), v4 = speed + step * a3,
                 a4 = acceleration(angle + step * v3);
    angle += step / 6 * (speed + 2 * v2 + 2 * v3 + v4);
    speed += step / 6 * (a1 + 2 * a2 + 2 * a3 + a4);
    rest += (angle - rest) - std::clamp(angle - rest, -limit, limit);
  }
};

TEST(Yielding, AFlapFallsAsItsSpringLetsItToFirstOrderInTheStep) {
  data::TriangleMesh mesh;
  mesh.vertices.resize(4, 3);
  mesh.vertices << 0, 0, 0, 0.1, 0, 0, 0.05, 0.1, 0, 0.05, -0.1, 0;
  mesh.triangles.resize(2, 3);
  mesh.triangles << 0, 1, 2, 1, 0, 3;
  const Sheet sheet = make_sheet(mesh);
  constexpr double yields_at = 1.5, seconds = 0.16;  // 0.15 rad, as (A_0 + A_1) / |e| is 0.1 m
  Flap flap{sheet.vertex_area[3] * 0.2, 0.1, rigidity, yields_at * 0.1};
  for (int k = 0; k < 160000; ++k) flap.advance(1e-6);
  ASSERT_GT(flap.rest, 0.2);  // it has yielded
  double error[3];
  for (int n = 0; n < 3; ++n) {
    const double step = 2e-3 / (1 << n);
    Environment environment = yielding_environment(sheet, yields_at);
    environment.gravity = {0, 0, -9.81};
    environment.materials[0].membrane_stiffness = 1e4;
    environment.holds = {{.vertices = {0, 1, 2}}};
    Solver solver(sheet, {.time_step = step, .max_iterations = 200, .tolerance = 1e-8});
    for (int k = 0; k < std::lround(seconds / step); ++k) EXPECT_TRUE(solver.step(environment).converged);
    const auto x = environment.state.positions.row(3);
    error[n] = std::atan2(-x[2], -x[1]) - flap.angle;
  }
  // First order halves with the step. The membrane stretches by m g / (E t), 1e-6 of the arm.
  for (int n = 0; n < 2; ++n) EXPECT_NEAR(error[n] / error[n + 1], 2, 0.2) << error[n];
  EXPECT_LT(std::abs(error[2]), 0.02);
}

TEST(Yielding, IsOfHingesAndOfNewtonOnTheCpuAlone) {
  const Sheet sheet = strip(3);
  Environment environment = yielding_environment(sheet, 10);
  EXPECT_NE(why_not_on_device(environment).find("yield_curvature"), std::string::npos);
  environment.materials[0].bending_model = data::BendingModel::plate;
  Solver solver(sheet, SolverSettings{});
  try {
    solver.step(environment);
    FAIL() << "it has to be refused";
  } catch (const data::InputError& error) {
    EXPECT_STREQ(error.what(),
                 "yield_curvature: bending_model: found plate, expected hinge, the only one that yields");
  }
}

}  // namespace
}  // namespace flash::sim
