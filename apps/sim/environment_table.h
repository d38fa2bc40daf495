#pragma once
#include <string>
#include <vector>

#include "sim/scene/variation.h"
#include "sim/worlds.h"

namespace flash::sim {

/// How one of many environments of a scene went, over all objects and steps.
struct EnvironmentFigures {
  int steps = 0, unconverged_steps = 0, halved_steps = 0;
  double residual_max = 0, penetration_max = 0;
  long iterations = 0;
  double kinetic = 0, elastic = 0;  ///< at the end [J]
  std::string why_lost;             ///< empty: it is not
};

/// Whether the motion of an environment may be used.
bool is_usable(const EnvironmentFigures& figures);

/// Adds a step of the worlds of each object.
void add_step(const std::vector<Worlds>& worlds, std::vector<EnvironmentFigures>& figures);

/// As CSV, a row each: environment, the factor of each variation, steps, unconverged_steps, halved_steps,
/// residual_max, penetration_max_m, iterations, kinetic_J, elastic_J, usable, lost.
std::string environment_table(const std::vector<Variation>& variations,
                              const std::vector<EnvironmentFigures>& figures);

}  // namespace flash::sim
