#pragma once
#include <vector>

#include "sysid/emulate/grid_search.h"

namespace flash::sysid {

/// Points of a grid of which all are emulated. Work: about what fewer tell, the answer simulates anew.
inline constexpr std::size_t most_emulated = 600;

/// The values of a large search that its answer begins with, so that the work does not grow with the grid.
/// All where there are no more than most_emulated points; else of each axis its ends, the best value, and
/// those that are 1, 2, 4, ... places from it. About what they tell, the answer simulates anew. `best`: a
/// point of the grid.
std::vector<Axis> focused(const std::vector<Axis>& axes, const std::vector<double>& best);

/// Those of the best point that has most.
std::vector<Axis> most_focused(const std::vector<Axis>& axes);

}  // namespace flash::sysid
