#pragma once
#include <Eigen/Core>
#include <vector>

#include "sim/scene/environment.h"
#include "sim/step/penetration.h"

namespace flash::sim {

/// Distance where no features of the surface may meet [m].
inline constexpr double no_layers = 1e300;

/// How one step of one environment went.
struct StepReport {
  double residual = 0;  ///< largest |r| / |M g| of a body; without gravity as if it were 9.81 m/s^2
  int iterations = 0;   ///< of Newton's method
  int solves = 0;       ///< solves with a factor: iterations of the linear solver
  int factorizations = 0;
  int substeps = 1;  ///< more where the step could not be solved as one
  /// Force balance to the tolerance, as a whole and to 30 times of it at every vertex; gaps and
  /// complementarity; no energy from nothing. Contact forces lie in the friction cone at every iterate.
  bool converged = false;
  double penetration_max = 0;     ///< deepest vertex below a surface, held ones too [m]
  Penetration held_penetration;   ///< the deepest that a hold carries below a surface
  Penetration start_penetration;  ///< the deepest other that started the step inside an obstacle
  Penetration no_room;            ///< the deepest free vertex that obstacles close on, at the end
  double layer_distance =
      no_layers;               ///< of the nearest features of the surface that may meet, at the end [m]
  int layer_touches = 0;       ///< pairs of features that press each other at the end
  long layer_pairs = 0;        ///< of features that were looked at, the most at a time
  long layer_ways = 0;         ///< of pairs that were followed by continuous detection
  double complementarity = 0;  ///< largest gap of a vertex that a surface pushes, or depth of any other [m]
  double kinetic = 0, membrane = 0, bending = 0, solid = 0, layers = 0, gravitational = 0;  ///< energies [J]
  double yielding = 0;  ///< lost over the step to bending that yields [J]
  double work = 0;      ///< work done on the sheet by holds and obstacles [J]
  // Forces of a step in parts are their means over time.
  std::vector<Eigen::Vector3d> hold_forces;      ///< hold on sheet, one a hold of the environment [N]
  std::vector<Eigen::Vector3d> obstacle_forces;  ///< obstacle on sheet, one an obstacle [N]
};

struct StepProblem;
struct Iterate;
struct ElasticEnergy;

/// Fills in forces, contact and penetration at the end of a step.
void report_contacts(const StepProblem& problem, const Iterate& end, StepReport& report);

/// Fills in the energies at the end of a step, after report_contacts. Returns whether they came from
/// somewhere: the potential of the step must not end above its start value. The energy must not end above
/// that of the start and the work done.
bool account_for_energy(const StepProblem& problem, const ElasticEnergy& elastic_at_start, const Iterate& end,
                        StepReport& report);

/// Adds the work of an attempt that was given up.
void add_work(const StepReport& given_up, StepReport& report);

/// The report of a step from those of its halves.
StepReport joined(const StepReport& first, const StepReport& second);

}  // namespace flash::sim
