// Steps of a device's own text, taken by one thread of the processor, beside the processor's Solver.
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/sim/cuda/contact_scenes.h"
#include "tests/sim/cuda/lifted_scenes.h"
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

// What has room on chip is computed alike in memory.
TEST(SerialStep, AMotionDoesNotDependOnWhatIsOnChip) {
  for (const contact_scenes::Scene& scene : contact_scenes::scenes(4)) {
    SCOPED_TRACE(scene.name);
    const ReplaySettings settings = contact_scenes::settings_of(3, 1e-3);
    const ReplayEnvironment environment = contact_scenes::for_device(scene);
    using contact_scenes::Trajectory;
    EXPECT_EQ(by_text<Trajectory>(scene.plan, environment, settings, true).positions,
              by_text<Trajectory>(scene.plan, environment, settings, false).positions);
  }
}

}  // namespace
}  // namespace flash::sim::cuda
