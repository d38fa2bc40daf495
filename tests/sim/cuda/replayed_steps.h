#pragma once
#include "sim/cuda/batch_replay.h"
#include "sim/newton/solver.h"

namespace flash::sim::cuda {

inline constexpr double time_step = 0.01;  ///< of the scenes of these tests [s]

/// Of a replay that keeps every step, with a fresh factor for each solve.
inline ReplaySettings settings_of(int steps, double tolerance) {
  ReplaySettings settings;
  settings.time_step = time_step;
  settings.tolerance = tolerance;
  settings.stale_factor_solves = 0;
  settings.steps = steps;
  for (int k = 1; k <= steps; ++k) settings.kept_steps.push_back(k);
  return settings;
}

/// What a replay says of a step, as the processor took it.
inline ReplayStep step_of(const StepReport& report) {
  return {report.residual,       report.penetration_max, report.iterations, report.solves,
          report.factorizations, report.substeps,        report.converged};
}

}  // namespace flash::sim::cuda
