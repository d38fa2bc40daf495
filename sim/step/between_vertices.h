#pragma once
#include "sim/scene/environment.h"
#include "sim/scene/sheet.h"

namespace flash::sim {

/// How far the triangles of a closed mesh come through the surface of what meets it.
struct ComingThrough {
  double depth = 0;  ///< [m]; 0: nowhere
  int obstacle = -1;
};

/// Contact is that of vertices, so that an edge or a corner of a mesh may come through a triangle between
/// them. The deepest in a mesh of the middles of all triangles and of their edges, where the environment
/// stands.
ComingThrough deepest_between_vertices(const Sheet& sheet, const Environment& environment);

}  // namespace flash::sim
