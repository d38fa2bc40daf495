// Steps of a device's own text, taken by one thread of the processor, beside the processor's Solver.
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/sim/cuda/contact_scenes.h"
#include "tests/sim/cuda/drawn_step.h"
#include "tests/sim/cuda/lifted_scenes.h"
#include "tests/sim/cuda/processor_iterate.h"
#include "tests/sim/cuda/serial_replay.h"

namespace flash::sim::cuda {
namespace {

using data::Points;

template <typename Trajectory>
Trajectory by_text(const std::shared_ptr<const SheetPlan>& plan, const ReplayEnvironment& environment,
                   const ReplaySettings& settings, bool on_chip = true) {
  SerialReplay replay(plan, environment, settings, on_chip);
  Trajectory trajectory;
  for (int k = 0; k < settings.steps; ++k) {
    replay.advance(1);
    trajectory.positions.push_back(replay.positions());
    if constexpr (requires { trajectory.forces; })
      for (const Eigen::Vector3d& force : replay.hold_forces(k)) trajectory.forces.push_back(force);
  }
  for (const ReplayStats& s : replay.stats())
    trajectory.steps.push_back(
        {s.residual, s.penetration, s.iterations, s.solves, s.factorizations, s.substeps, s.converged != 0});
  return trajectory;
}

// Every membrane and bending model, both dampings, a load, holds in some axes.
TEST(SerialStep, LiftedSheetsMoveAsTheProcessorHasThem) {
  using namespace lifted_scenes;
  for (Scene scene : scenes()) {
    SCOPED_TRACE(scene.name);
    scene.steps = 10;
    for (const double tolerance : {1e-3, 1e-5}) {
      const auto text =
          by_text<Trajectory>(scene.plan, scene.environment, settings_of(scene.steps, tolerance));
      const Trajectory processor = by_processor(scene, tolerance);
      for (const ReplayStep& step : text.steps) {
        EXPECT_TRUE(step.converged);
        EXPECT_LE(step.residual, tolerance);
      }
      EXPECT_LE(distance(scene, text, processor), tolerance == 1e-3 ? 1e-4 : 1e-6);
    }
  }
}

// Every shape, at rest and moving, with friction, slow and fast; sheets that start inside. A step that is
// halved, or a way out that is given up, is another equation (common_steps), and a sheet that buckles has
// several solutions.
TEST(SerialStep, SheetsOnObstaclesMoveAsTheProcessorHasThem) {
  using namespace contact_scenes;
  int soon_apart = 0, compared = 0;
  for (Scene scene : scenes(8)) {
    scene.steps = std::min(scene.steps, 12);
    for (const double tolerance : {1e-3, 1e-5}) {
      ++compared;
      SCOPED_TRACE(scene.name + ", tolerance " + std::to_string(tolerance));
      const auto text =
          by_text<Trajectory>(scene.plan, for_device(scene), settings_of(scene.steps, tolerance));
      const Trajectory processor = by_processor(scene, tolerance);
      for (std::size_t k = 0; k < text.steps.size(); ++k)
        EXPECT_TRUE(text.steps[k].converged || !processor.steps[k].converged);
      const std::size_t steps =
          std::min(common_steps(text, processor), steps_of_one_solution(scene, tolerance, processor));
      for (std::size_t k = 0; k < steps; ++k)
        EXPECT_NEAR(text.steps[k].penetration_max, processor.steps[k].penetration_max, 1e-6);
      soon_apart += steps < 5;
      EXPECT_LE(distance(scene, text, processor, steps), drift(scene, tolerance));
      ASSERT_EQ(text.forces.size(), processor.forces.size());
      const double weight = weight_of(scene);
      for (std::size_t k = 0; k < std::min(text.forces.size(), steps); ++k)
        EXPECT_LE((text.forces[k] - processor.forces[k]).norm(),
                  100 * tolerance * weight + 1e-2 * processor.forces[k].norm());
    }
  }
  // Which ones a threshold parts at once is chance; most are compared over several steps.
  EXPECT_LE(5 * soon_apart, compared);
}

/// How far an end of a step is from that which balances exactly, where its surroundings are convex: the
/// matrix is no less than mass over h^2, so that vertices miss it by no more than |r| h^2 / m [m].
double way_of_residual(const DrawnStep& drawn, double tolerance) {
  const Eigen::VectorXd mass = masses_of(drawn.plan->sheet, drawn.environment.materials[0]);
  const double gravity = drawn.environment.gravity.norm();
  return tolerance * mass.norm() * (gravity > 0 ? gravity : 9.81) * drawn.h * drawn.h / mass.minCoeff();
}

/// The end of the step by the processor.
struct ProcessorStep {
  Environment environment;
  StepReport report;

  ProcessorStep(const DrawnStep& drawn, double tolerance, int stale_factor_solves = 4)
      : environment(drawn.environment) {
    Solver solver(drawn.plan,
                  {.time_step = drawn.h, .tolerance = tolerance, .stale_factor_solves = stale_factor_solves});
    report = solver.step(environment);
  }
  const Points& positions() const { return environment.state.positions; }
};

double distance(const Points& a, const Points& b) { return (a - b).rowwise().norm().maxCoeff(); }

// Contact, friction, rigid and soft holds, loads, all materials. Where surroundings are not convex a step may
// have several ends, and which of them is found is chance: the processor misses its own end as often, where
// it renews its factor at each solve.
TEST(SerialStep, AStepOfADrawnWorldEndsWhereTheProcessorHasIt) {
  constexpr double tolerance = 1e-5;
  int compared = 0, halved = 0, apart = 0, renewed_apart = 0;
  const bool passed = rc::check([&] {
    const DrawnStep drawn(draw_world);
    SerialReplay text = drawn.serial(tolerance);
    text.advance(1);
    const ReplayStats& stats = text.stats().front();
    const ProcessorStep processor(drawn, tolerance);
    RC_ASSERT(stats.converged == (processor.report.converged ? 1 : 0));
    if (processor.report.substeps != stats.substeps || stats.substeps > 1) {
      ++halved;
      return;
    }
    ++compared;
    const double allowed = 2 * way_of_residual(drawn, tolerance);
    const ProcessorStep renewed(drawn, tolerance, 0);
    if (distance(renewed.positions(), processor.positions()) > allowed) ++renewed_apart;
    if (distance(text.positions(), processor.positions()) > allowed) {
      // Its end is one all the same: forces balance there, by the processor's own.
      const ProcessorIterate end(drawn, text.positions());
      RC_ASSERT(end.problem.balanced(end.at, (1 + 1e-3) * tolerance));
      ++apart;
      return;
    }
    RC_ASSERT(distance(text.velocities(), processor.environment.state.velocities) <= allowed / drawn.h);
    RC_ASSERT(std::abs(stats.penetration - processor.report.penetration_max) <= allowed + 2e-9);
    // Each is within the residual of its step.
    const double weight = 9.81 * masses_of(drawn.plan->sheet, drawn.environment.materials[0]).sum();
    const auto expect_alike = [&](const std::vector<Eigen::Vector3d>& own,
                                  const std::vector<Eigen::Vector3d>& other) {
      RC_ASSERT(own.size() == other.size());
      for (std::size_t k = 0; k < own.size(); ++k)
        RC_ASSERT((own[k] - other[k]).norm() <= 100 * tolerance * weight + 1e-2 * other[k].norm());
    };
    expect_alike(text.hold_forces(0), processor.report.hold_forces);
    expect_alike(text.obstacle_forces(0), processor.report.obstacle_forces);
    RC_ASSERT(std::abs(stats.kinetic - processor.report.kinetic) <= 1e-3 * processor.report.kinetic + 1e-12);
  });
  EXPECT_TRUE(passed);
  EXPECT_LE(apart - renewed_apart, 4 * std::sqrt(apart + renewed_apart + 1.0));  // counts of chance
  EXPECT_LE(3 * halved, compared);
}

/// A sheet without weight whose corner a hand turns by half a radian in a step of `h`, which is taken in two
/// halves as no iteration may solve it. `soft`: by springs.
struct Turned {
  static constexpr double h = 0.01;
  std::shared_ptr<const SheetPlan> plan = make_sheet_plan(small_sheet(4));
  Environment environment = environment_of(plan->sheet);
  ReplaySettings settings;

  explicit Turned(bool soft) {
    environment.gravity.setZero();
    const Eigen::Vector3d axis = Eigen::Vector3d(1, 2, 3).normalized();
    const Eigen::Isometry3d from = Eigen::Isometry3d(Eigen::Translation3d(0.1, 0, 0.05)),
                            to = Eigen::Translation3d(0.1, 0.001, 0.05) * Eigen::AngleAxisd(0.5, axis);
    environment.schedule =
        std::make_shared<const Schedule>(Schedule{.start = 0, .time_step = h, .frames = {{from, to}}});
    environment.holds = {{.vertices = {0, 1, 5}, .frame = 0}};
    if (soft) environment.holds[0].stiffness = Eigen::Vector3d(1, 10, 100);
    settings.time_step = h;
    settings.steps = 1;
    settings.max_iterations = 0;
    settings.halvings = 1;
  }
};

// In the middle of a step holds and springs are where their frame has them, which the processor asks for.
TEST(SerialStep, WhatHoldsCarryIsOnTheArcOfTheirFrameInTheMiddleOfAStep) {
  for (const bool soft : {false, true}) {
    Turned turned(soft);
    Environment moved = turned.environment;
    const auto springs = motion_of_springs(moved, Turned::h, 1);
    const auto holds = std::make_shared<const HoldMotion>(motion_of_holds(moved, Turned::h, 1));
    SerialReplay text(turned.plan, replay_environment(turned.environment, holds, springs), turned.settings);
    text.advance(1);
    Solver solver(turned.plan, {.time_step = Turned::h, .max_iterations = 0, .halvings = 1});
    const StepReport report = solver.step(turned.environment);
    ASSERT_EQ(report.substeps, 2);
    ASSERT_EQ(text.stats().front().substeps, 2);
    // Places of 0.1 m to their rounding, over half a step.
    EXPECT_LE(distance(text.positions(), turned.environment.state.positions), 1e-15);
    EXPECT_LE(distance(text.velocities(), turned.environment.state.velocities), 1e-15 / (0.5 * Turned::h));
    EXPECT_GT(turned.environment.state.velocities.norm(), 1);
  }
}

// What has room on chip is computed alike in memory.
TEST(SerialStep, AMotionDoesNotDependOnWhatIsOnChip) {
  for (const contact_scenes::Scene& scene : contact_scenes::scenes(4)) {
    SCOPED_TRACE(scene.name);
    const ReplaySettings settings = settings_of(3, 1e-3);
    const ReplayEnvironment environment = contact_scenes::for_device(scene);
    using contact_scenes::Trajectory;
    EXPECT_EQ(by_text<Trajectory>(scene.plan, environment, settings, true).positions,
              by_text<Trajectory>(scene.plan, environment, settings, false).positions);
  }
}

}  // namespace
}  // namespace flash::sim::cuda
