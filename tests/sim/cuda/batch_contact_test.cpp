// Sheets on obstacles: replays on the device beside the processor's Solver, and closed forms.
#ifdef FLASH_HAVE_CUDA
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <string>

#include "sim/cuda/batch_replay.h"
#include "sim/cuda/batch_system.h"
#include "sim/cuda/devices.h"
#include "sim/cuda/hold_motion.h"
#include "sim/cuda/most_obstacles.h"
#include "sim/newton/solver.h"
#include "tests/sim/cuda/contact_scenes.h"
#include "tests/sim/sheet_scene.h"
#include "tests/sim/sliding_mass.h"

namespace flash::sim::cuda {
namespace {

using namespace contact_scenes;

#define SKIP_WITHOUT_DEVICE() \
  if (const std::string why = why_no_device(); !why.empty()) GTEST_SKIP() << why

std::vector<Trajectory> by_device(const std::shared_ptr<const SheetPlan>& plan,
                                  const std::vector<ReplayEnvironment>& environments,
                                  const ReplaySettings& settings) {
  BatchReplay replay(plan, environments, settings);
  replay.advance(settings.steps);
  std::vector<Trajectory> all;
  for (int e = 0; e < replay.size(); ++e) {
    Trajectory& own = all.emplace_back();
    for (int k = 0; k < settings.steps; ++k) own.positions.push_back(replay.kept_positions(e, k));
    own.steps = replay.stats(e);
    const std::vector<double> forces = replay.hold_forces(e);
    for (std::size_t k = 0; k < forces.size(); k += 3)
      own.forces.emplace_back(forces[k], forces[k + 1], forces[k + 2]);
  }
  return all;
}

TEST(BatchContact, TrajectoriesAreThoseOfTheProcessorAndCloserAsTheToleranceFalls) {
  SKIP_WITHOUT_DEVICE();
  int soon_apart = 0, compared = 0;
  for (const Scene& scene : scenes()) {
    for (const double tolerance : {1e-3, 1e-5}) {
      ++compared;
      SCOPED_TRACE(scene.name + ", tolerance " + std::to_string(tolerance));
      const Trajectory device =
                           by_device(scene.plan, {for_device(scene)}, settings_of(scene.steps, tolerance))[0],
                       processor = by_processor(scene, tolerance);
      int unconverged = 0;
      // Where the processor solves a step the device does.
      for (std::size_t k = 0; k < device.steps.size(); ++k)
        unconverged += processor.steps[k].converged && !device.steps[k].converged;
      const std::size_t steps =
          std::min(common_steps(device, processor), steps_of_one_solution(scene, tolerance, processor));
      for (std::size_t k = 0; k < steps; ++k)
        EXPECT_NEAR(device.steps[k].penetration_max, processor.steps[k].penetration_max, 1e-6);
      EXPECT_EQ(unconverged, 0);
      soon_apart += steps < 5;
      EXPECT_LE(distance(scene, device, processor, steps), drift(scene, tolerance));
      // Each is within the residual of its step; what a hold carries beyond is of the positions.
      ASSERT_EQ(device.forces.size(), processor.forces.size());
      const double weight = weight_of(scene);
      for (std::size_t k = 0; k < std::min(device.forces.size(), steps); ++k)
        EXPECT_LE((device.forces[k] - processor.forces[k]).norm(),
                  100 * tolerance * weight + 1e-2 * processor.forces[k].norm());
    }
  }
  // Which ones a threshold parts at once is chance; all but a tenth are compared over several steps.
  EXPECT_LE(10 * soon_apart, compared);
}

TEST(BatchContact, ABatchEqualsAloneBitwiseRunAfterRun) {
  SKIP_WITHOUT_DEVICE();
  // Those with a schedule of their own, and without: all in one batch.
  const std::vector<Scene> all = scenes();
  constexpr int steps = 6;
  ReplaySettings settings = settings_of(steps, 1e-3);
  settings.restart_interval = 3;
  std::vector<ReplayEnvironment> environments;
  for (int round = 0; round < 20; ++round)
    for (const Scene& scene : all) {
      environments.push_back(for_device(scene));
      environments.back().material.membrane_stiffness += round;
      environments.back().hold_count = 1;
    }
  const auto together = by_device(all[0].plan, environments, settings),
             again = by_device(all[0].plan, environments, settings);
  for (std::size_t e = 0; e < environments.size(); ++e) {
    EXPECT_EQ(together[e].positions, again[e].positions);
    if (e >= all.size() && e % 20 != 3) continue;
    EXPECT_EQ(together[e].positions, by_device(all[0].plan, {environments[e]}, settings)[0].positions);
  }
}

/// A flat sheet on a plane that leans by `angle`, under gravity that is turned instead.
Scene on_incline(double angle, double friction) {
  const auto plan = sheet(6);
  Scene scene{"incline", plan, environment_of(plan->sheet), 20};
  Environment& e = scene.environment;
  e.materials[0].membrane_stiffness = 60;
  e.materials[0].bending_rigidity = 5e-5;
  e.materials[0].friction = friction;
  e.gravity = 9.81 * Vector3d(std::sin(angle), 0, -std::cos(angle));
  e.obstacles = {{Plane{}}};
  return scene;
}

TEST(BatchContact, OnAnInclineASheetSticksBelowTheAngleOfFrictionAndSlidesAbove) {
  SKIP_WITHOUT_DEVICE();
  constexpr double friction = 0.4;
  const double limit = std::atan(friction);
  for (const double share : {0.2, 0.99, 1.01, 1.5}) {
    SCOPED_TRACE(share);
    const Scene scene = on_incline(share * limit, friction);
    const Trajectory device = by_device(scene.plan, {for_device(scene)}, settings_of(scene.steps, 1e-6))[0];
    const Points moved = device.positions.back() - scene.environment.state.positions;
    for (const ReplayStep& step : device.steps) EXPECT_TRUE(step.converged);
    if (share < 1) {
      // Bristles bend by their length. The speed that is left then, length / h, is braked by the rest of
      // friction.
      const double longest = bristle_length(time_step), speed = longest / time_step,
                   braking = 9.81 * (friction * std::cos(share * limit) - std::sin(share * limit));
      EXPECT_LE(moved.cwiseAbs().maxCoeff(), longest + 0.5 * speed * speed / braking);
      continue;
    }
    // Of the weight 30 times the tolerance may be missing.
    const double expected = slide_down(share * limit, friction, 9.81, time_step, scene.steps).place,
                 seconds = scene.steps * time_step;
    EXPECT_LE((moved.col(0).array() - expected).abs().maxCoeff(), 0.5 * 3e-5 * 9.81 * seconds * seconds);
    EXPECT_LE(moved.rightCols(2).cwiseAbs().maxCoeff(), 1e-9);
  }
}

TEST(BatchContact, ASheetAtRestPushesWithItsWeightAlone) {
  SKIP_WITHOUT_DEVICE();
  // Nothing moves: the table carries each vertex where it is.
  const Scene scene = on_incline(0, 0.3);
  const Trajectory device = by_device(scene.plan, {for_device(scene)}, settings_of(5, 1e-6))[0];
  EXPECT_EQ((device.positions.back() - scene.environment.state.positions).cwiseAbs().maxCoeff(), 0);
}

TEST(BatchContact, MoreObstaclesThanThereIsRoomForAreRefused) {
  SKIP_WITHOUT_DEVICE();
  Scene scene = on_incline(0, 0.3);
  scene.environment.obstacles.resize(most_obstacles + 1, {Plane{}});
  EXPECT_THROW(BatchReplay(scene.plan, {for_device(scene)}, settings_of(1, 1e-3)), std::invalid_argument);
}

}  // namespace
}  // namespace flash::sim::cuda
#endif
