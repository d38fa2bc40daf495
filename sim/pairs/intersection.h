#pragma once
#include <optional>
#include <utility>

#include "data/mesh/surface_crossing.h"
#include "sim/pairs/pair_surface.h"

namespace flash::sim {

using data::passes;

/// Two triangles of the surface, which share no vertex, that pass through each other at `positions`; those of
/// the lowest numbers. Empty where there are none.
std::optional<std::pair<int, int>> first_intersection(PairSurface& surface, const data::Points& positions);

/// Two bodies, the first of which stands wholly inside the second, a solid, at `positions` where no triangles
/// pass through each other; those of the lowest numbers. Empty where there are none. It asks one vertex of
/// each body how often a ray from it leaves each solid.
std::optional<std::pair<int, int>> first_enclosed(const Sheet& sheet, const PairSurface& surface,
                                                  const data::Points& positions);

}  // namespace flash::sim
