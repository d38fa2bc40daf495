#pragma once
#include <array>
#include <cmath>
#include <limits>
#include <memory>

#include "sim/cuda/hold_motion.h"
#include "tests/sim/cuda/serial_replay.h"
#include "tests/sim/properties/drawn_world.h"

namespace flash::sim::cuda {

/// A world before a step of `h`, and a place near the end of that step.
struct DrawnStep {
  std::shared_ptr<const SheetPlan> plan = make_sheet_plan(draw_sheet());
  Environment environment;
  double h = draw_log(2e-3, 2e-2);
  data::Points positions;

  explicit DrawnStep(Environment (*draw_environment)(const Sheet&))
      : environment(draw_environment(plan->sheet)) {
    for (Hold& hold : environment.holds)
      if (hold.axes == std::array{true, true, true} && draw_chance(0.5)) {
        hold.stiffness.resize(std::ssize(hold.vertices));
        for (double& own : hold.stiffness)
          own = draw_chance(0.2) ? std::numeric_limits<double>::infinity() : draw_log(1e-2, 1e3);
      }
    positions = environment.state.positions + h * environment.state.velocities;
    // Some so crumpled that triangles collapse.
    positions += draw_noise(positions.rows(), draw(0, draw_chance(0.2) ? 0.8 : 0.05) * cell());
  }

  double cell() const { return std::sqrt(plan->sheet.vertex_area.mean()); }

  /// By the text of a device.
  SerialReplay serial(double tolerance = 1e-3) const {
    ReplaySettings settings;
    settings.time_step = h;
    settings.tolerance = tolerance;
    settings.steps = 1;
    Environment moved = environment;
    const auto springs = motion_of_springs(moved, h, 1);
    const auto holds = std::make_shared<const HoldMotion>(motion_of_holds(moved, h, 1));
    return {plan, replay_environment(environment, holds, springs), settings, draw_chance(0.5)};
  }
};

}  // namespace flash::sim::cuda
