#pragma once
#include <optional>
#include <string>
#include <vector>

#include "sysid/replay/replay.h"

namespace flash::sysid {

/// "sheet:0.4x0.4:0.02[:pattern]" or "box:0.1x0.03x0.03:0.01" with its cell times a factor; empty for
/// anything else.
std::string scaled_cell(const std::string& specification, double factor);

/// The same recording on cells of half the size, keyframes weighing as they do: meshed anew by its
/// specification, or the tetrahedra of a file split. Empty for a sheet from a file, and in a shape of its
/// own.
Replay on_half_the_cell(const Replay& replay);

std::vector<Replay> on_half_the_cell(const std::vector<Replay>& replays);

/// Other cells of replays whose cells shrink towards grasps, of which on_half_the_cell leaves those of the
/// sheet as they are; both empty where one is not such a replay.
struct OtherCells {
  std::vector<Replay> of_sheet;  ///< all cells halved
  std::vector<Replay> between;   ///< those at the grasps halved: halfway to on_half_the_cell
};
OtherCells other_cells(const std::vector<Replay>& replays);

}  // namespace flash::sysid
