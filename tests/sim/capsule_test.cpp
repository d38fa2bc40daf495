#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "sim/step/moving_obstacles.h"
#include "tests/sim/obstacle_depth.h"
#include "tests/sim/sheet_scene.h"

namespace flash::sim {
namespace {

using Eigen::Vector3d;

TEST(Capsule, ItsGapIsTheDistanceToItsAxisLessItsRadius) {
  for (const double half_length : {0.0, 0.01, 0.3}) {
    const Capsule capsule{{0.1, 0, -0.1}, Vector3d(2, 1, 2) / 3, half_length, 0.2};
    Environment environment;
    environment.obstacles = {{capsule}};
    const MovingObstacle<double> moving = moving_obstacles(environment, 0, 0)[0];
    for (int sample = 0; sample < 500; ++sample) {
      const Vector3d point = Vector3d::Random();
      double nearest = 1e9;
      constexpr int parts = 2000;
      for (int k = 0; k <= parts; ++k)
        nearest = std::min(
            nearest, (point - capsule.centre - half_length * (2.0 * k / parts - 1) * capsule.axis).norm());
      // The best of the parts is beside the foot of the perpendicular by half of one, s, at most: s^2 / 2 d
      // farther.
      const double beside = half_length / parts;
      EXPECT_NEAR(gap_to(moving, vector3(point)).distance, nearest - capsule.radius,
                  beside * beside / (2 * nearest) + 1e-12);
    }
  }
}

/// Height over the radius, cos theta, at which a sheet as small as a particle leaves a sphere without
/// friction on which it starts at rest at cos theta = `from`.
double leaves_at(double from, double time_step) {
  const double radius = 1, side = 1e-4;
  const Sheet sheet = small_sheet(1, side);
  Environment environment = environment_of(sheet);
  environment.materials[0].friction = 0;
  environment.obstacles = {{Capsule{Vector3d::Zero(), Vector3d::UnitZ(), 0, radius}}};
  const double start = std::acos(from);
  const Eigen::AngleAxisd lean(start, Vector3d::UnitY());
  for (int i = 0; i < sheet.rest.vertices.rows(); ++i) {
    const Vector3d flat = Vector3d(sheet.rest.vertices.row(i)) - Vector3d(side / 2, side / 2, 0);
    environment.state.positions.row(i) = radius * (lean * Vector3d(flat.x(), flat.y(), radius)).normalized();
  }
  Solver solver(sheet, {.time_step = time_step, .tolerance = 1e-6});
  double left = -1, height = from;
  while (height > 0.5) {
    const double before = height;
    const double force = solver.step(environment).obstacle_forces[0].norm();
    height = environment.state.positions.col(2).mean() / radius;
    // The last step on the sphere: a turning sheet may lose it for a step.
    if (force > 0) left = 0.5 * (height + before);
  }
  return left;
}

TEST(Capsule, AParticleLeavesAFrictionlessSphereAtTwoThirdsOfItsHeight) {
  // m v^2 / R = m g cos theta and v^2 = 2 g R (c - cos theta) from rest at cos theta = c: at 2 c / 3.
  const double from = std::cos(0.1), expected = 2 * from / 3;
  for (const double time_step : {8e-3, 4e-3, 2e-3, 1e-3, 5e-4}) {
    // In a step it sinks by v sin(theta) h <= sqrt(2 g / 3) h of the radius of 1 m, of which the place of
    // leaving is known to a half. Implicit Euler takes energy: each step a^2 h^2 / 2, with a <= g, of g (c -
    // cos theta) in all; in the time that it takes, sqrt(1 / g) ln(...) < 1.2 s, so of the height h g 1.2
    // / 2.
    const double error = std::sqrt(2 * 9.81 / 3) / 2 * time_step + 0.6 * 9.81 * time_step;
    EXPECT_NEAR(leaves_at(from, time_step), expected, error) << time_step;
  }
}

TEST(Capsule, ASheetLiesOverASphereAndAFinger) {
  const Sheet sheet = small_sheet(10, 0.2);
  const double radius = 0.05;
  for (const double half_length : {0.0, 0.06}) {
    SCOPED_TRACE(half_length);
    Environment environment = environment_of(sheet);
    environment.materials[0].friction = 0.8;
    environment.materials[0].bending_rigidity = 1e-4;
    environment.materials[0].air_drag = 10;
    environment.obstacles = {
        {Capsule{{0.1, 0.1, -radius - 0.002}, Vector3d(1, 1, 0).normalized(), half_length, radius}}};
    Solver solver(sheet, {.tolerance = 1e-5});
    StepReport report;
    double deepest = 0;
    for (int n = 0; n < 200; ++n) {
      report = solver.step(environment);
      EXPECT_TRUE(report.converged) << n;
      for (int i = 0; i < sheet.rest.vertices.rows(); ++i)
        deepest = std::max(deepest, depth_in(environment, environment.obstacles[0],
                                             environment.state.positions.row(i), environment.state.time));
    }
    EXPECT_LT(deepest, 1e-9);
    const double weight = environment.materials[0].areal_density * sheet.vertex_area.sum() * 9.81;
    // What still moves, slowed by drag, accelerates by less than a hundredth of gravity.
    EXPECT_NEAR(report.obstacle_forces[0].z(), weight, 1e-2 * weight);
  }
}

}  // namespace
}  // namespace flash::sim
