#pragma once
#include <string>
#include <vector>

#include "sysid/emulate/grid_search.h"
#include "sysid/replay/replay.h"

namespace flash::sysid {

/// The candidate of a search that bends most easily under its weight.
ReplayCandidate limpest_candidate(const GridSettings& settings);

/// A line for each grasp of which the cells hold another patch than was stated: less or more of a corner, or,
/// of other places of a sheet, another part on half of the cells.
std::vector<std::string> warnings_of_grasps(const std::vector<Replay>& replays);

/// What is known before a search and makes its answer worse.
struct KnownBefore {
  std::vector<std::string> warnings;  ///< whatever the answer
  std::vector<std::string> notices;   ///< of a part of the searched range
};

/// What is simulated next.
enum class Coming {
  answer,   ///< of a search, on smaller cells where these are coarse
  search,   ///< on these cells alone
  estimate  ///< of an earlier search
};

/// Each a line, with the option that mends it: warnings_of_grasps, and cells that are coarse for the fold of
/// the sheet (coarse_cells.h).
KnownBefore known_before(const std::vector<Replay>& replays, const GridSettings& settings, Coming coming);

/// A search of one value an axis, as one that goes on from an estimate begins.
GridSettings held_at(const std::vector<double>& values, GridSettings settings);

}  // namespace flash::sysid
