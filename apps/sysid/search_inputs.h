#pragma once
#include <string>
#include <vector>

#include "data/recording/recording.h"
#include "sysid/emulate/grid_search.h"
#include "sysid/replay/replay.h"

namespace flash {

/// Where a verb goes on from a search, whose folder is `run`: throws data::InputError where the object of the
/// recording is of another size than `replay`, the recording on the mesh of the search.
void check_size(const sysid::Replay& replay, const data::Recording& recording, const std::string& run);

/// What differs from the asset of the search, a line each: "areal_density: found 0.3, the search had 0.2".
std::vector<std::string> unlike_the_asset_of(const std::string& run, const sysid::Fingerprint& print);

}  // namespace flash
