#pragma once
#include <vector>

#include "sysid/emulate/grid_search.h"
#include "sysid/observe/horizon.h"

namespace flash::sysid {

/// The candidate at `values` with each searched parameter, and each that counts as unknown (held_parameters),
/// changed by itself: by `share` of its value, or, where it may be zero or is an angle or a place, by that of
/// the width that it is searched or assumed within.
std::vector<NearbyCandidate> nearby_candidates(const std::vector<double>& values, const GridSettings& grid,
                                               const std::vector<Replay>& replays, double share = 1e-3);

}  // namespace flash::sysid
