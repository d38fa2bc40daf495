// Replays on the device beside the processor's Solver, and closed forms.
#ifdef FLASH_HAVE_CUDA
#include "sim/cuda/batch_replay.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <string>

#include "sim/cuda/batch_system.h"
#include "sim/cuda/devices.h"
#include "sim/newton/solver.h"
#include "tests/sim/cuda/lifted_scenes.h"
#include "tests/sim/cuda/meshes.h"
#include "tests/sim/sheet_scene.h"

namespace flash::sim::cuda {
namespace {

using namespace lifted_scenes;

#define SKIP_WITHOUT_DEVICE() \
  if (const std::string why = why_no_device(); !why.empty()) GTEST_SKIP() << why

Trajectory trajectory_of(const BatchReplay& replay, int e, int steps) {
  Trajectory trajectory;
  for (int k = 0; k < steps; ++k) trajectory.positions.push_back(replay.kept_positions(e, k));
  trajectory.steps = replay.stats(e);
  return trajectory;
}

Trajectory by_device(const Scene& scene, double tolerance) {
  BatchReplay replay(scene.plan, {scene.environment}, settings_of(scene.steps, tolerance));
  replay.advance(scene.steps);
  return trajectory_of(replay, 0, scene.steps);
}

TEST(BatchReplay, TrajectoriesAreThoseOfTheProcessorAndCloserAsTheToleranceFalls) {
  SKIP_WITHOUT_DEVICE();
  for (const Scene& scene : scenes()) {
    SCOPED_TRACE(scene.name);
    for (const double tolerance : {1e-3, 1e-5}) {
      const Trajectory device = by_device(scene, tolerance), processor = by_processor(scene, tolerance);
      for (const ReplayStep& step : device.steps) {
        EXPECT_TRUE(step.converged);
        EXPECT_LE(step.residual, tolerance);
      }
      EXPECT_LE(distance(scene, device, processor), tolerance == 1e-3 ? 1e-4 : 1e-6);
      // As many iterations: at a threshold rounding decides.
      const auto iterations = [](const Trajectory& trajectory) {
        int sum = 0;
        for (const ReplayStep& step : trajectory.steps) sum += step.iterations;
        return sum;
      };
      const int expected = iterations(processor);
      EXPECT_NEAR(iterations(device), expected, 0.05 * expected + 1);
    }
  }
}

/// The same scene with other materials, starts and holds.
std::vector<ReplayEnvironment> family(const Scene& scene, int count) {
  std::vector<ReplayEnvironment> environments;
  for (int e = 0; e < count; ++e) {
    ReplayEnvironment environment = scene.environment;
    environment.material.membrane_stiffness = 20.0 + 15 * e;
    environment.material.bending_rigidity = 2e-5 * (1 + e % 4);
    environment.velocities.col(0).setConstant(0.05 * e);
    if (e % 3 == 1) environment.holds = nullptr;
    environments.push_back(environment);
  }
  return environments;
}

void expect_equal(const Trajectory& a, const Trajectory& b) {
  EXPECT_EQ(a.positions, b.positions);
  ASSERT_EQ(a.steps.size(), b.steps.size());
  for (std::size_t k = 0; k < a.steps.size(); ++k) {
    EXPECT_EQ(a.steps[k].residual, b.steps[k].residual);
    EXPECT_EQ(a.steps[k].solves, b.steps[k].solves);
  }
}

TEST(BatchReplay, ABatchEqualsAloneBitwiseRunAfterRunAndInParts) {
  SKIP_WITHOUT_DEVICE();
  constexpr int count = 7, steps = 9;
  const std::vector<Scene> all = scenes();
  for (const std::size_t which : {std::size_t{4}, std::size_t{5}, std::size_t{9}}) {
    SCOPED_TRACE(all[which].name);
    const std::vector<ReplayEnvironment> environments = family(all[which], count);
    ReplaySettings settings = settings_of(steps, 1e-3);
    settings.restart_interval = 3;
    settings.stale_factor_solves = 5;
    const auto run = [&](const std::vector<ReplayEnvironment>& chosen, int part) {
      BatchReplay replay(all[which].plan, chosen, settings);
      for (int step = 0; step < steps; step += part) replay.advance(part);
      std::vector<Trajectory> trajectories;
      for (int e = 0; e < replay.size(); ++e) trajectories.push_back(trajectory_of(replay, e, steps));
      return trajectories;
    };
    const auto together = run(environments, steps), again = run(environments, steps),
               in_parts = run(environments, 3);
    for (int e = 0; e < count; ++e) {
      const auto at = static_cast<std::size_t>(e);
      expect_equal(together[at], again[at]);
      expect_equal(together[at], in_parts[at]);
      expect_equal(together[at], run({environments[at]}, steps)[0]);
    }
  }
}

// More environments than the device has teams for: each comes back to the queue several times.
TEST(BatchReplay, EnvironmentsThatWaitForATeamAreAsEachAlone) {
  SKIP_WITHOUT_DEVICE();
  constexpr int count = 701, steps = 6;
  const Scene scene = scenes().front();
  const std::vector<ReplayEnvironment> environments = family(scene, count);
  ReplaySettings settings = settings_of(steps, 1e-3);
  settings.restart_interval = 2;
  BatchReplay together(scene.plan, environments, settings);
  together.advance(steps);
  for (int e = 0; e < count; e += 100) {
    BatchReplay alone(scene.plan, {environments[static_cast<std::size_t>(e)]}, settings);
    alone.advance(steps);
    expect_equal(trajectory_of(together, e, steps), trajectory_of(alone, 0, steps));
    EXPECT_EQ(together.velocities(e), alone.velocities(0));
  }
}

Trajectory by_team(const Scene& scene, int most_groups, int blocks = 0) {
  ReplaySettings settings = settings_of(scene.steps, 1e-3);
  settings.fronts = {.leaf_size = 6, .panel_capacity = 12 * 1024, .most_groups = most_groups};
  settings.team_blocks = blocks;
  BatchReplay replay(scene.plan, {scene.environment}, settings);
  replay.advance(scene.steps);
  return trajectory_of(replay, 0, scene.steps);
}

// What compute-sanitizer's racecheck can follow: it does not know barriers of some warps.
TEST(BatchReplay, AnUndividedTeamMovesASheetAsTheProcessorDoes) {
  SKIP_WITHOUT_DEVICE();
  for (const std::size_t which : {std::size_t{5}, std::size_t{9}}) {
    Scene scene = scenes()[which];
    scene.steps = 3;
    for (const int blocks : {1, 8})
      EXPECT_LE(distance(scene, by_team(scene, 1, blocks), by_processor(scene, 1e-3)), 1e-4);
  }
}

TEST(BatchReplay, AMotionDoesNotDependOnHowATeamIsDivided) {
  SKIP_WITHOUT_DEVICE();
  Scene scene = scenes()[5];
  scene.steps = 4;
  expect_equal(by_team(scene, 1), by_team(scene, block_warps));
}

TEST(BatchReplay, AMotionDoesNotDependOnHowManyProcessorsWorkOnIt) {
  SKIP_WITHOUT_DEVICE();
  for (const std::size_t which : {std::size_t{5}, std::size_t{9}}) {
    Scene scene = scenes()[which];
    scene.steps = 4;
    const auto by_blocks = [&](int blocks) {
      ReplaySettings settings = settings_of(scene.steps, 1e-3);
      settings.team_blocks = blocks;
      BatchReplay replay(scene.plan, {scene.environment}, settings);
      EXPECT_EQ(replay.team_blocks(), blocks);
      replay.advance(scene.steps);
      return trajectory_of(replay, 0, scene.steps);
    };
    const Trajectory one = by_blocks(1);
    for (const int blocks : {2, 4, 8}) expect_equal(one, by_blocks(blocks));
  }
}

TEST(BatchReplay, AFallingSheetMovesAsImplicitEulerSays) {
  SKIP_WITHOUT_DEVICE();
  constexpr int steps = 20;
  for (const double drag : {0.0, 2.0}) {
    const auto plan = grid();
    ReplayEnvironment environment = resting(*plan);
    environment.positions = plan->sheet.rest.vertices;
    environment.material.air_drag = drag;
    environment.gravity = {1, 2, -9};
    BatchReplay replay(plan, {environment}, settings_of(steps, 1e-9));
    replay.advance(steps);
    Vector3d speed = Vector3d::Zero(), fallen = Vector3d::Zero();
    for (int k = 0; k < steps; ++k) {
      speed = (speed + time_step * environment.gravity) / (1 + drag * time_step);
      fallen += time_step * speed;
      const Points expected = plan->sheet.rest.vertices.rowwise() + fallen.transpose();
      // A residual of 1e-9 of the weight in each step, over h^2 / m: no more than its fall times that.
      EXPECT_LE((replay.kept_positions(0, k) - expected).cwiseAbs().maxCoeff(), 1e-7 * fallen.norm() + 1e-13);
    }
    EXPECT_LE((replay.velocities(0).rowwise() - speed.transpose()).cwiseAbs().maxCoeff(),
              1e-7 * speed.norm());
  }
}

TEST(BatchReplay, AStepThatIterationsDoNotSolveIsTakenInHalves) {
  SKIP_WITHOUT_DEVICE();
  Scene scene = scenes().front();
  scene.steps = 12;
  ReplaySettings settings = settings_of(scene.steps, 1e-4);
  settings.max_iterations = 2;
  BatchReplay replay(scene.plan, {scene.environment}, settings);
  replay.advance(scene.steps);
  const Trajectory device = trajectory_of(replay, 0, scene.steps);
  int most = 0;
  for (const ReplayStep& step : device.steps) {
    EXPECT_TRUE(step.converged);
    EXPECT_LE(step.residual, 1e-4);
    most = std::max(most, step.substeps);
  }
  EXPECT_GT(most, 1);
  // Shorter steps are another discretization: of an acceleration a over t, h a t / 2 apart.
  const double time = scene.steps * time_step;
  EXPECT_LE((device.positions.back() - by_processor(scene, 1e-4).positions.back()).cwiseAbs().maxCoeff(),
            0.5 * time_step * 2 * 9.81 * time);
}

TEST(BatchReplay, AnEnvironmentThatIsNotFiniteLeavesTheOthersAlone) {
  SKIP_WITHOUT_DEVICE();
  constexpr int steps = 3;
  const Scene scene = scenes().front();
  std::vector<ReplayEnvironment> environments = family(scene, 3);
  environments[1].velocities(5, 2) = std::nan("");
  BatchReplay replay(scene.plan, environments, settings_of(steps, 1e-3));
  replay.advance(steps);
  EXPECT_FALSE(replay.stats(1).front().converged);
  for (const int e : {0, 2}) {
    BatchReplay alone(scene.plan, {environments[static_cast<std::size_t>(e)]}, settings_of(steps, 1e-3));
    alone.advance(steps);
    expect_equal(trajectory_of(replay, e, steps), trajectory_of(alone, 0, steps));
  }
}

TEST(BatchReplay, WhatDoesNotFitIsRefused) {
  SKIP_WITHOUT_DEVICE();
  const Scene scene = scenes().front();
  const auto refused = [&](const std::function<void(ReplayEnvironment&)>& change) {
    ReplayEnvironment other = scene.environment;
    change(other);
    EXPECT_THROW(BatchReplay(scene.plan, {scene.environment, other}, settings_of(3, 1e-3)),
                 std::invalid_argument);
  };
  refused([](ReplayEnvironment& e) { e.positions.conservativeResize(3, 3); });
  refused([](ReplayEnvironment& e) { e.holds = std::make_shared<HoldMotion>(2); });
  refused([](ReplayEnvironment& e) {
    const HeldVertex held{1, {true, true, true}, Vector3d::Zero()};
    e.holds = std::make_shared<HoldMotion>(3, std::vector<HeldVertex>{held, held});
  });
  const auto with_spring = [](SpringMotion spring, double stiffness, std::size_t steps = 3) {
    return [=](ReplayEnvironment& e) {
      e.springs = std::make_shared<SpringMotions>(steps, std::vector<SpringMotion>{spring});
      e.stiffness = {stiffness};
    };
  };
  const SpringMotion spring{1, 0, 0, {true, true, true}, Vector3d::Zero(), Vector3d::Zero()};
  refused(with_spring(spring, -1));
  refused(with_spring(spring, std::numeric_limits<double>::infinity()));
  refused(with_spring(spring, 10, 2));
  for (int SpringMotion::*number : {&SpringMotion::vertex, &SpringMotion::hold, &SpringMotion::entry}) {
    SpringMotion other = spring;
    other.*number = 100000;
    refused(with_spring(other, 10));
  }
  EXPECT_THROW(BatchReplay(scene.plan, {}, settings_of(3, 1e-3)), std::invalid_argument);
}

}  // namespace
}  // namespace flash::sim::cuda
#endif
