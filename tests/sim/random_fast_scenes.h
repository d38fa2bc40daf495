#pragma once
#include <string>

#include "sim/newton/solver.h"

namespace flash::sim {

/// What meets what in a random fast scene: two sheets face to face, one that flies at the other with its edge
/// ahead, two in one plane, two cubes, a cube and a sheet, the legs of one sheet bent to a U, a cube that a
/// gripper carries at what is in its way, and a sheet that a moving board strikes.
enum class FastSceneKind {
  faces,
  edge_on,
  in_plane,
  cubes,
  cube_on_sheet,
  legs,
  carried,
  board,
  last = board
};
const char* to_string(FastSceneKind kind);

/// A world drawn by lot whose bodies close at 1 to 40 m/s: half of them without friction, steps of 10 ms or
/// of 1 to 30 ms, in which bodies fly up to 30 times their size.
struct RandomFastScene {
  FastSceneKind kind;
  std::string description;
  Sheet sheet;
  Environment environment;
  SolverSettings settings;
  int steps = 10;
};

/// The same seed gives the same scene, on every machine.
RandomFastScene random_fast_scene(unsigned long seed);

/// What an observer finds who knows positions alone, at the end of each part of a step.
struct FastFindings {
  int steps = 0, parts = 0, unconverged = 0, halved = 0, touching = 0, iterations = 0;
  int most_iterations = 0;  ///< of a step
  /// Parts of steps on whose straight way features meet, or at whose end they go through each other or stand
  /// inside a solid.
  int passing = 0;
  int silent = 0;   ///< those of steps that are told as solved
  int crossed = 0;  ///< times that a free vertex went through an obstacle
  bool finite = true;
};

FastFindings observe(RandomFastScene scene);

}  // namespace flash::sim
