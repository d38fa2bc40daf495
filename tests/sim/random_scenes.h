#pragma once
#include <string>
#include <vector>

#include "sim/newton/solver.h"

namespace flash::sim {

/// What happens to the sheet of a random scene.
enum class SceneKind { drop, impact, drape, lift, drag, corner, pusher, deep, last = deep };
const char* to_string(SceneKind kind);

/// A world drawn by lot: mesh, material over six decades of stiffness, steps of 1 to 30 ms, obstacles, jerks.
struct RandomScene {
  SceneKind kind;
  std::string mesh;  ///< specification
  Sheet sheet;
  Environment environment;
  SolverSettings settings;
  int steps = 40;
};

/// Of the boxes and cylinders, how many are other shapes instead: surfaces of triangles, and of the rest
/// capsules and spheres.
struct ShapeShares {
  double round = 0, meshes = 0;
};

/// The same seed gives the same scene, on every machine.
RandomScene random_scene(unsigned long seed, const ShapeShares& shares = {});

/// The same of a block of tetrahedra, of one of three laws, from foam to hard rubber.
RandomScene random_solid_scene(unsigned long seed, const ShapeShares& shares = {});

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

/// The same for a sheet at rest that starts across such obstacles, from thin boards to blocks it lies
/// in whole; of kind `deep`.
RandomScene random_deep_start(unsigned long seed, const ShapeShares& shares = {});

SceneFindings observe(RandomScene scene);

}  // namespace flash::sim
