#include "sim/newton/step_end.h"

#include <gtest/gtest.h>

#include <limits>
#include <string>

#include "sim/cuda/hold_motion.h"
#include "sim/newton/step_problem.h"
#include "tests/sim/cuda/serial_replay.h"
#include "tests/sim/sheet_scene.h"

namespace flash::sim {
namespace {

using Eigen::Vector3d;

TEST(StepEnd, EnergyComesFromWhatWasThereAndFromWork) {
  EnergyAccount account = {.kinetic_at_start = 1,
                           .kinetic_at_end = 2.5,
                           .stored_at_start = 2,
                           .stored_at_end = 1,
                           .falls = 0.5,
                           .work = -1,
                           .unbalanced = 0.01,
                           .bristles = 0.02,
                           .rounding = 0.03};
  EXPECT_FALSE(account.balances());  // 1.5 - 1 - 0.5 + 1 = 1
  account.work = 0.98;
  // A hundredth of 1 + 2 + 0.5 + 0.98, and what is told.
  EXPECT_NEAR(account.allowed(), 0.0448 + 0.06, 1e-15);
  account.kinetic_at_end = 2.48 + 0.1048 - 1e-12;
  account.falls = 0.5;
  account.work = 0.98;
  account.stored_at_end = 2 + 1e-13;
  EXPECT_TRUE(account.balances());
  account.kinetic_at_end += 2e-12;
  EXPECT_FALSE(account.balances());
  account.kinetic_at_end = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(account.balances());
}

TEST(StepEnd, RoundingIsTheWeightOverANanometreAndTheMembraneAtItsPrecision) {
  EXPECT_DOUBLE_EQ(rounding_of_weight(2, 9.81), 1.962e-8);
  EXPECT_DOUBLE_EQ(rounding_of_membrane(0.2, 60, 0.5), 2.4e-13);
}

TEST(StepEnd, ContactIsSettledToANanometre) {
  EXPECT_TRUE(is_complementary(0.99e-9));
  EXPECT_FALSE(is_complementary(1.01e-9));
  EXPECT_FALSE(is_complementary(std::numeric_limits<double>::quiet_NaN()));
}

TEST(StepEnd, ALinearProblemIsSolvedToAThirdOfWhatTheStepNeeds) {
  EXPECT_DOUBLE_EQ(linear_target(2, 10), 0.6);
  EXPECT_DOUBLE_EQ(linear_target(10, 2), 0.6);
}

/// A sheet of 169 vertices at rest without weight, whose lightest vertex is pulled by `weights` times the
/// tolerance times its weight on earth, and the rest by nothing.
struct Pulled {
  static constexpr double h = 0.01, tolerance = 1e-3, earth = 9.81;
  std::shared_ptr<const SheetPlan> plan = make_sheet_plan(
      make_sheet(data::rectangle({.width = 0.24, .height = 0.24, .cells_x = 12, .cells_y = 12})));
  Environment environment = environment_of(plan->sheet);

  explicit Pulled(double weights) {
    environment.gravity.setZero();
    Eigen::Index lightest = 0;
    const double mass = environment.materials[0].areal_density * plan->sheet.vertex_area.minCoeff(&lightest);
    environment.loads = {{static_cast<int>(lightest), Vector3d(0, 0, weights * tolerance * mass * earth)}};
  }
  bool balanced_on_the_processor() const {
    const StepProblem problem(*plan, environment, h, {.speed = 1});
    Iterate at;
    at.positions = environment.state.positions;
    at.contacts = begin_step(problem.contacts, at.positions);
    problem.evaluate(at);
    return problem.balanced(at, tolerance);
  }
  bool balanced_by_the_text_of_a_device() const {
    const cuda::ReplayEnvironment replay = cuda::replay_environment(environment, nullptr);
    cuda::ReplaySettings settings;
    settings.time_step = h;
    settings.tolerance = tolerance;
    settings.steps = 1;
    return cuda::SerialReplay(plan, replay, settings).evaluate(replay.positions).balanced;
  }
};

// Thirty tolerances of a vertex: the norm of all of them would allow more, being that of 169 vertices, most
// of them three times as heavy.
TEST(StepEnd, NoVertexMissesThirtyTolerancesOfItsWeight) {
  const Pulled lightly(29), strongly(31);
  const Eigen::VectorXd& area = lightly.plan->sheet.vertex_area;
  ASSERT_LT(31 * area.minCoeff(), area.norm());
  ASSERT_GT(area.minCoeff(), 0.1 * area.mean());  // and it is judged by its own weight
  EXPECT_TRUE(lightly.balanced_on_the_processor());
  EXPECT_TRUE(lightly.balanced_by_the_text_of_a_device());
  EXPECT_FALSE(strongly.balanced_on_the_processor());
  EXPECT_FALSE(strongly.balanced_by_the_text_of_a_device());
}

/// Parts in which a step is taken that may not iterate, with a residual of so many weights from the start,
/// and a tolerance below it.
int parts_of_a_step(double weights, bool by_text) {
  Pulled pulled(0);
  Environment& environment = pulled.environment;
  for (int i = 0; i < pulled.plan->sheet.vertex_area.size(); ++i)
    environment.loads.push_back({i, Vector3d(0, 0,
                                             weights * Pulled::earth * pulled.plan->sheet.vertex_area[i] *
                                                 environment.materials[0].areal_density)});
  if (!by_text) {
    Solver solver(pulled.plan,
                  {.time_step = Pulled::h, .max_iterations = 0, .tolerance = 1e-9, .halvings = 1});
    return solver.step(environment).substeps;
  }
  const cuda::ReplayEnvironment replay = cuda::replay_environment(environment, nullptr);
  cuda::ReplaySettings settings;
  settings.time_step = Pulled::h;
  settings.max_iterations = 0;
  settings.tolerance = 1e-9;
  settings.halvings = 1;
  settings.steps = 1;
  cuda::SerialReplay text(pulled.plan, replay, settings);
  text.advance(1);
  return text.stats().front().substeps;
}

// A millionth of the weight is all that rounding allows at times.
TEST(StepEnd, AStepThatRoundingKeepsFromItsToleranceIsNotHalved) {
  for (const bool by_text : {false, true}) {
    EXPECT_EQ(parts_of_a_step(0.99e-6, by_text), 1) << by_text;
    EXPECT_EQ(parts_of_a_step(1.01e-6, by_text), 2) << by_text;
  }
}

TEST(StepEnd, ADeviceHalvesAStepSixteenTimesAtMost) {
  const Pulled pulled(1);
  cuda::ReplayEnvironment replay;
  replay.positions = pulled.environment.state.positions;
  replay.velocities = pulled.environment.state.velocities;
  cuda::ReplaySettings settings;
  settings.steps = 1;
  settings.halvings = 16;
  EXPECT_NO_THROW(cuda::SerialReplay(pulled.plan, replay, settings));
  settings.halvings = 17;
  EXPECT_THROW(cuda::SerialReplay(pulled.plan, replay, settings), std::invalid_argument);
}

}  // namespace
}  // namespace flash::sim
