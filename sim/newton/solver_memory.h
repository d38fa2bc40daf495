#pragma once
#include "sim/scene/sheet.h"

namespace flash::sim {

/// Memory that a Solver takes with the plan of a sheet [bytes]: solver_bytes_per_vertex. With tetrahedra it
/// is 750 times the cube root of the number of vertices for each, where that is more: their factor grows
/// faster. Measured on cubes of 1,300 to 12,000 vertices; slender solids take less.
double solver_bytes(const Sheet& sheet);

}  // namespace flash::sim
