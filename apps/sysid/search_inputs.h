#pragma once
#include <string>
#include <vector>

#include "data/recording/recording.h"
#include "sysid/emulate/grid_search.h"
#include "sysid/replay/replay.h"
#include "sysid/report/searched_mesh.h"

namespace flash {

/// Where a verb goes on from a search, whose folder is `run`: the mesh on which that simulated the recording
/// or one of its size (sysid::searched_mesh).
void take_mesh(const sysid::Summary& search, const std::string& run, const data::Recording& recording,
               sysid::ReplaySettings& settings);

/// What differs from the asset of the search, a line each: "areal_density: found 0.3, the search had 0.2".
std::vector<std::string> unlike_the_asset_of(const std::string& run, const sysid::Fingerprint& print);

}  // namespace flash
