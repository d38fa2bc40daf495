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

/// Of all of them; empty where one has none.
std::vector<Replay> on_half_the_cell(const std::vector<Replay>& replays);

}  // namespace flash::sysid
