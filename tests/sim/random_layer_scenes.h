#pragma once
#include <string>

#include "sim/newton/solver.h"

namespace flash::sim {

/// What happens to the layers of a random scene: a pile let fall, one sheet of which the legs of a U fly at
/// each other, a scroll dropped, pleats pushed together, a corner carried through the sheet, and soft blocks
/// between sheets.
enum class LayerSceneKind { pile, thrown, scroll, pleats, corner, blocks, last = blocks };
const char* to_string(LayerSceneKind kind);

/// A world drawn by lot whose surface meets itself: thin and thick layers, needles for triangles, steps of
/// 1 to 30 ms.
struct RandomLayerScene {
  LayerSceneKind kind;
  std::string description;
  Sheet sheet;
  Environment environment;
  SolverSettings settings;
  int steps = 40;
};

/// The same seed gives the same scene, on every machine. None starts with triangles that pass through others.
/// Nothing starts faster than `fastest` [m/s]; nor is it carried so.
RandomLayerScene random_layer_scene(unsigned long seed, double fastest = 1);

/// What an observer finds who knows positions and reports alone.
struct LayerFindings {
  int steps = 0, unconverged = 0, halved = 0, touching = 0;
  int passing = 0;  ///< steps at whose end triangles pass through each other, solved or not
  int iterations = 0;
  double residual_max = 0;       ///< of unconverged steps
  double energy_gain_share = 0;  ///< of a converged step, over the energy that was there or put in
  bool finite = true;
};

LayerFindings observe(RandomLayerScene scene);

}  // namespace flash::sim
