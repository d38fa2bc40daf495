#pragma once
#include <string>
#include <vector>

#include "sysid/emulate/grid_search.h"

namespace flash::sysid {

/// What one experiment would tell of each parameter, others unknown too.
struct PlannedExperiment {
  std::string name;
  std::vector<double> spread;  ///< one standard deviation, one an axis: of its logarithm or in its unit; no
                               ///< larger than what is known without the experiment
};

struct PlanSettings {
  GridSettings grid;       ///< axes: the parameters asked for, each with the range that is thought possible
  std::vector<double> at;  ///< where the sensitivities are measured, one an axis
  double error = 1e-3;     ///< of a keyframe: the distance by which model and sheet differ [m]
  double keyframes = 10;   ///< that count as independent
};

/// Spreads from the Fisher information F = n / error^2 J^T J, J the sensitivities of what is observed with
/// registration projected out, and a prior that is the searched range (a uniform of that width): (F + P)^-1.
/// The errors of a keyframe are taken as common to it: n keyframes, not points.
PlannedExperiment plan_experiment(const std::string& name, const std::vector<Replay>& replays,
                                  const PlanSettings& settings);

/// Spread of each parameter by its range alone.
std::vector<double> spread_of_ranges(const std::vector<Axis>& axes);

}  // namespace flash::sysid
