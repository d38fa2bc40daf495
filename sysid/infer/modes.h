#pragma once
#include <cstddef>
#include <string>
#include <vector>

#include "sysid/emulate/results_store.h"

namespace flash::sysid {

/// Best candidates of the separate parts of the region that scores below `level`, best first; indices into
/// GridResults::candidates of a complete grid. A valley narrower than the grid falls apart into islands, so
/// candidates are in one part where a chain of candidates below the level joins them, each at most two steps
/// away along every axis, or else a path through the interpolated score (ScoreInterpolant) that stays within
/// twice the region's radius, s^2 - s_best^2 < 4 (level^2 - s_best^2): one coordinate led from one to the
/// other, those left at their least, each of the others then in turn.
std::vector<std::size_t> separate_modes(const GridResults& results, double level);

/// One line that names the best of another region and what to do; empty where there is one region.
std::string warning_of_modes(const GridResults& results, double level);

}  // namespace flash::sysid
