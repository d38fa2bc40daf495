#pragma once
#include <vector>

#include "sysid/emulate/grid_search.h"
#include "sysid/replay/memory_estimate.h"

namespace flash::sysid {

/// Before anything is simulated: from vertices, steps and candidates. `solver_check`: whether the answer is
/// solved again, on half the cell too and, of a graded mesh, on smaller cells of the sheet.
MemoryEstimate estimate_memory(const std::vector<Replay>& replays, const GridSettings& settings,
                               bool solver_check);

}  // namespace flash::sysid
