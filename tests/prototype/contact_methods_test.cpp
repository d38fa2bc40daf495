// Hard rows between layers, by both prototypes, against closed forms.

#include <gtest/gtest.h>

#include <cmath>

#include "tests/prototype/row_solver.h"
#include "tests/sim/layer_scenes.h"

namespace flash::sim {
namespace {

constexpr double h = 0.01, tolerance = 1e-3;
constexpr SelfContact cloth{.thickness = 1e-3, .friction = 0.3, .pressure = 2500};

class ContactMethods : public testing::TestWithParam<RowMethod> {};

INSTANTIATE_TEST_SUITE_P(Prototype, ContactMethods,
                         testing::Values(RowMethod::multipliers, RowMethod::augmented),
                         [](const auto& method) {
                           return method.param == RowMethod::multipliers ? "Multipliers" : "Augmented";
                         });

TEST_P(ContactMethods, ASheetOnAnotherPressesWithItsWeightAtTheThickness) {
  LayerScene world = pile(2, cloth, 0.1, 6);
  RowSolver solver(world.sheet, GetParam(), {.time_step = h, .tolerance = tolerance});
  StepReport report;
  for (int k = 0; k < 60; ++k) {
    report = solver.step(world.environment);
    ASSERT_TRUE(report.converged) << k;
  }
  const double weight = 0.2 * 0.1 * 0.1 * 9.81;  // of a sheet
  double pressed = 0;
  for (const LayerTouch& touch : solver.layers().touches)
    pressed += touch.normal_force * std::abs(touch.normal.z);
  // |r| <= tolerance |M g|, so that the sum misses the tolerance of the weight, for masses that are much
  // alike.
  EXPECT_NEAR(pressed, weight, 2 * tolerance * weight);
  EXPECT_NEAR(report.obstacle_forces[0].z(), 2 * weight, 4 * tolerance * weight);
  EXPECT_NEAR(report.layer_distance, cloth.thickness, row_tolerance * cloth.thickness);
  const auto upper = rows_of(world.sheet.bodies[1], world.environment.state.positions).col(2);
  EXPECT_NEAR(upper.mean(), cloth.thickness, row_tolerance * cloth.thickness);
}

TEST_P(ContactMethods, ALayerSlidesWhereTheSlopeIsAboveItsFriction) {
  constexpr int steps = 40;  // in these it does not reach the edge of the layer below
  const auto speed_on = [&](double slope) {
    LayerScene world = layer_on_incline(slope, cloth);
    RowSolver solver(world.sheet, GetParam(), {.time_step = h, .tolerance = tolerance});
    for (int k = 0; k < steps; ++k) EXPECT_TRUE(solver.step(world.environment).converged) << k;
    return mean_velocity(world, world.sheet.bodies.back()).x();
  };
  EXPECT_LT(std::abs(speed_on(0.299)), tolerance * 9.81 * h);  // what the tolerance lets a step change
  const double slope = 0.32;
  const double speed = 9.81 * std::cos(std::atan(slope)) * (slope - cloth.friction) * steps * h;
  // Forces are right to the tolerance, and layers are rough to 0.001 of the force (SelfContact tests).
  EXPECT_NEAR(speed_on(slope), speed, 0.02 * speed + 9.81 * 1e-3 * steps * h);
}

}  // namespace
}  // namespace flash::sim
