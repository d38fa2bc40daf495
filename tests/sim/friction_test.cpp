#include <gtest/gtest.h>

#include <cmath>

#include "sim/law/vertex_contact.h"
#include "tests/sim/sheet_scene.h"

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
      // Implicit Euler takes less than the way of the continuum, v^2 / (2 a), by half of the last step.
      const double braking = -acceleration_down(ratio);
      EXPECT_NEAR(stopped(0, 0) - sheet.rest.vertices(0, 0), 0.5 * speed * speed / braking,
                  0.5 * speed * time_step + 1e-9);
      const int steps = static_cast<int>(std::lround(10 / time_step));
      run(solver, environment, steps);
      // A vertex that sticks has not slipped by more than the rounding of its position.
      EXPECT_LE((environment.state.positions - stopped).cwiseAbs().maxCoeff(), steps * resting_slip);
    }
}

TEST(Friction, ASheetSlidesAsImplicitEulerSaysAtAnyTimeStep) {
  const Sheet sheet = small_sheet(1, 0.02);
  for (const double time_step : {1e-2, 1e-3, 1e-4})
    for (const double ratio : {1.01, 1.1, 2.0}) {
      SCOPED_TRACE(::testing::Message() << "h = " << time_step << ", ratio " << ratio);
      Environment environment = on_incline(sheet, ratio);
      Solver solver(sheet, {.time_step = time_step, .tolerance = 1e-8});
      const int steps = 100;
      run(solver, environment, steps);
      // Under a force that does not change the speeds of implicit Euler are those of the continuum. In the
      // n-th step the slip is n a h^2, and its smooth start takes half of (smoothing / slip)^2 of friction;
      // the sum of 1 / n^2 is pi^2 / 6. What the tolerance leaves is 30 times 1e-8 of the weight.
      const double acceleration = acceleration_down(ratio), seconds = steps * time_step;
      const double first_slip = acceleration * time_step * time_step;
      const double lacking = std::pow(slip_smoothing(time_step) / first_slip, 2) * M_PI * M_PI / 12;
      const double speed = environment.state.velocities.col(0).mean();
      EXPECT_NEAR(speed, acceleration * seconds,
                  lacking * friction * gravity * time_step + 3e-7 * gravity * seconds);
    }
}

}  // namespace
}  // namespace flash::sim
