#pragma once
#include "tests/sim/random_scenes.h"

namespace flash::sim {

/// What an observer finds who knows positions, velocities, forces and obstacles alone.
struct SceneFindings {
  int steps = 0, unconverged = 0, halved = 0;
  double residual_max = 0;  ///< of unconverged steps
  double unseen_depth = 0;  ///< deepest that a vertex is in an obstacle, beyond what the step reported [m]
  double free_depth = 0;    ///< deepest of the vertices that nothing holds, unless it started there [m]
  double exit_speed = 0;    ///< fastest that a vertex leaves an obstacle it started in [m/s]
  double energy_gain = 0;   ///< largest gain of a converged step beyond the work done on the sheet [J]
  double energy_gain_share = 0;  ///< the same over the energy that was there to begin with and put in since
  double shot_speed = 0;         ///< of kind `deep`: fastest vertex, beyond what falling gives it [m/s]
  int inside = 0;                ///< vertices that nothing holds in an obstacle at the end
  int crossed = 0;               ///< times that a free vertex went through an obstacle in a converged step
  bool finite = true;
};

/// Whether the straight way from `from` to `to`, seen from the obstacle as it moves, goes through it: in by
/// one face of a box and out by the one behind, or past the axis of a cylinder.
bool goes_through(const Environment& environment, const Obstacle& obstacle, const Eigen::Vector3d& from,
                  const Eigen::Vector3d& to, double from_time, double to_time);

/// Simulates the scene to its end.
SceneFindings observe(RandomScene scene);

}  // namespace flash::sim
