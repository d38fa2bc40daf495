#pragma once
#include "sim/scene/environment.h"
#include "sim/scene/sheet.h"

namespace flash::sim {

/// How far the triangles of a closed mesh, or of a sheet, are inside an obstacle.
struct ComingThrough {
  double depth = 0;  ///< [m]; 0: nowhere
  int obstacle = -1;
  double time = 0;  ///< [s]
};

/// Contact is that of vertices, so that an edge or a corner of an obstacle, and what is thinner than a cell,
/// may come through a triangle between them. The deepest place of all triangles where the environment stands,
/// if it is deeper than `from` [m], to a tenth of that: in a mesh of the middles of triangles and of their
/// edges alone. Triangles of which a vertex is as deep itself, or held by the obstacle's frame, do not count.
ComingThrough deepest_between_vertices(const Sheet& sheet, const Environment& environment, double from);

}  // namespace flash::sim
