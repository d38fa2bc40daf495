#pragma once
#include "data/procedural_mesh.h"
#include "sim/newton/solver.h"

namespace flash::sim {

/// A sheet at rest in its rest shape, without obstacles or supports.
inline Environment environment_of(const Sheet& sheet) {
  Environment environment;
  environment.state.positions = sheet.rest.vertices;
  environment.state.velocities = data::Points::Zero(sheet.rest.vertices.rows(), 3);
  return environment;
}

inline Sheet small_sheet(int cells = 6, double side = 0.12) {
  return make_sheet(data::rectangle({.width = side,
                                     .height = side,
                                     .cells_x = cells,
                                     .cells_y = cells,
                                     .pattern = data::DiagonalPattern::jittered}));
}

}  // namespace flash::sim
