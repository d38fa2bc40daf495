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

/// The same for a sheet at rest that starts across such obstacles, from thin boards to blocks it lies
/// in whole; of kind `deep`.
RandomScene random_deep_start(unsigned long seed, const ShapeShares& shares = {});

}  // namespace flash::sim
