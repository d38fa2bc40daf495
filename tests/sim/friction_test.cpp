#include <gtest/gtest.h>

#include <cmath>

#include "tests/sim/sheet_scene.h"
#include "tests/sim/sliding_mass.h"

namespace flash::sim {
namespace {

using Eigen::Vector3d;

constexpr double gravity = 9.81;
constexpr double friction = 0.3;

/// A sheet on an incline whose slope is `ratio` of what friction holds. x points down it.
Environment on_incline(const Sheet& sheet, double ratio) {
  Environment environment = environment_of(sheet);
  const double angle = std::atan(ratio * friction);
  environment.gravity = gravity * Vector3d(std::sin(angle), 0, -std::cos(angle));
  environment.materials[0].friction = friction;
  environment.obstacles = {{Plane{}}};
  return environment;
}

/// g (sin - mu cos) [m/s^2].
double acceleration_down(double ratio) {
  const double angle = std::atan(ratio * friction);
  return gravity * (std::sin(angle) - friction * std::cos(angle));
}

void run(Solver& solver, Environment& environment, int steps) {
  for (int n = 0; n < steps; ++n) ASSERT_TRUE(solver.step(environment).converged) << n;
}

TEST(Friction, ASheetThatSlidBelowItsConeStopsAndStays) {
  const Sheet sheet = small_sheet(1, 0.02);
  for (const double time_step : {1e-2, 1e-3})
    for (const double ratio : {0.0, 0.5, 0.9, 0.99}) {
      SCOPED_TRACE(::testing::Message() << "h = " << time_step << ", ratio " << ratio);
      Environment environment = on_incline(sheet, ratio);
      const double speed = 0.01;
      environment.state.velocities.col(0).setConstant(speed);
      Solver solver(sheet, {.time_step = time_step, .tolerance = 1e-8});
      run(solver, environment, static_cast<int>(std::lround(1 / time_step)));
      const data::Points stopped = environment.state.positions;
      // Implicit Euler takes less than the way of the continuum, v^2 / (2 a), by half of the last step. The
      // bristles bend as well.
      const double braking = -acceleration_down(ratio);
      EXPECT_NEAR(stopped(0, 0) - sheet.rest.vertices(0, 0), 0.5 * speed * speed / braking,
                  0.5 * speed * time_step + bristle_length(time_step));
      const int steps = static_cast<int>(std::lround(10 / time_step));
      run(solver, environment, steps);
      // It rests where bristles balance the weight to 30 times the tolerance. That is a share of their length
      // over mu to either side, and does not grow with time.
      EXPECT_LE((environment.state.positions - stopped).cwiseAbs().maxCoeff(),
                2 * 30 * 1e-8 * bristle_length(time_step) / friction + 1e-13);
    }
}

TEST(Friction, ASheetSlidesAsImplicitEulerSaysAtAnyTimeStep) {
  const Sheet sheet = small_sheet(1, 0.02);
  for (const double time_step : {1e-2, 1e-3, 1e-4})
    for (const double ratio : {1.01, 1.1, 2.0}) {
      SCOPED_TRACE(::testing::Message() << "h = " << time_step << ", ratio " << ratio);
      Environment environment = on_incline(sheet, ratio);
      Solver solver(sheet, {.time_step = time_step, .tolerance = 1e-8});
      const int steps = 300;
      run(solver, environment, steps);
      const SlidingMass expected =
          slide_down(std::atan(ratio * friction), friction, gravity, time_step, steps);
      // What the tolerance leaves is 30 times 1e-8 of the weight.
      EXPECT_NEAR(environment.state.velocities.col(0).mean(), expected.speed,
                  3e-7 * gravity * steps * time_step);
    }
}

TEST(Friction, AShakenSheetBelowItsConeDoesNotCreep) {
  // Along a table that moves to and fro, at most by what friction carries.
  const Sheet sheet = small_sheet(1, 0.02);
  const double time_step = 1e-3, amplitude = 1e-3, frequency = 2 * M_PI * 5;
  const int steps = 2000;
  data::Trajectory shaking;
  for (int n = 0; n <= steps; ++n) {
    shaking.times.push_back(n * time_step);
    shaking.poses.push_back(
        Eigen::Isometry3d(Eigen::Translation3d(amplitude * (1 - std::cos(frequency * n * time_step)), 0, 0)));
  }
  ASSERT_LT(amplitude * frequency * frequency, friction * gravity);
  Environment environment = environment_of(sheet);
  environment.materials[0].friction = friction;
  environment.obstacles = {{Plane{}}};
  environment.obstacles[0].frame = add_frame(environment, shaking, time_step);
  Solver solver(sheet, {.time_step = time_step, .tolerance = 1e-8});
  run(solver, environment, steps);
  // Ten whole periods: the table is back where it started, and so is the sheet.
  EXPECT_LE((environment.state.positions - sheet.rest.vertices).leftCols<2>().cwiseAbs().maxCoeff(),
            bristle_length(time_step));
}

TEST(Friction, ASheetOnATurningTableTurnsWithIt) {
  // Off the axis, where it needs a third of what friction carries.
  const Sheet sheet = small_sheet(1, 0.02);
  const double time_step = 0.01, speed = 2 * M_PI, radius = 0.08, ramp = 1;  // [s] [rad/s] [m] [s]
  const int steps = 500;
  ASSERT_LT(radius * speed * speed, 1.1 * friction * gravity);
  const auto angle = [&](double time) {
    return time < ramp ? speed * time * time / (2 * ramp) : speed * (time - 0.5 * ramp);
  };
  data::Trajectory turning;
  for (int n = 0; n <= steps; ++n) {
    turning.times.push_back(n * time_step);
    turning.poses.push_back(Eigen::Isometry3d(Eigen::AngleAxisd(angle(n * time_step), Vector3d::UnitZ())));
  }
  Environment environment = environment_of(sheet);
  environment.materials[0].friction = 3 * friction;
  environment.obstacles = {{Plane{}}};
  environment.obstacles[0].frame = add_frame(environment, turning, time_step);
  environment.state.positions.col(0).array() += radius;
  const data::Points start = environment.state.positions;
  Solver solver(sheet, {.time_step = time_step, .tolerance = 1e-8});
  const auto carried = [&] {
    const Eigen::AngleAxisd back(-angle(environment.state.time), Vector3d::UnitZ());
    return data::Points(environment.state.positions * back.toRotationMatrix().transpose());
  };
  run(solver, environment, 200);
  const data::Points after_a_turn = carried();
  run(solver, environment, steps - 200);
  // Bristles bend by less than their length, and have bent once the speed is reached.
  EXPECT_LE((carried() - start).leftCols<2>().cwiseAbs().maxCoeff(), 2 * bristle_length(time_step));
  EXPECT_LE((carried() - after_a_turn).leftCols<2>().cwiseAbs().maxCoeff(), 0.01 * bristle_length(time_step));
}

TEST(Friction, WhatLeansOnASlidingWallDoesNotCreep) {
  // The table carries what the wall's friction pulls: of two surfaces at a vertex one slides, one holds.
  const Sheet sheet = small_sheet(1, 0.02);
  const double time_step = 0.01, wall_speed = 0.1;
  const int steps = 300;
  data::Trajectory along;
  for (int n = 0; n <= steps; ++n) {
    along.times.push_back(n * time_step);
    along.poses.push_back(Eigen::Isometry3d(Eigen::Translation3d(0, wall_speed * n * time_step, 0)));
  }
  Environment environment = environment_of(sheet);
  environment.gravity = Vector3d(0.8 * gravity, 0, -gravity);
  environment.materials[0].friction = 0.5;
  environment.obstacles = {
      {Plane{}},
      {Plane{Vector3d(environment.state.positions.col(0).maxCoeff(), 0, 0), -Vector3d::UnitX()}, {0.3}}};
  environment.obstacles[1].frame = add_frame(environment, along, time_step);
  Solver solver(sheet, {.time_step = time_step, .tolerance = 1e-8});
  run(solver, environment, steps / 3);
  const data::Points early = environment.state.positions;
  run(solver, environment, steps - steps / 3);
  EXPECT_LE((environment.state.positions - early).cwiseAbs().maxCoeff(), 0.01 * bristle_length(time_step));
}

}  // namespace
}  // namespace flash::sim
