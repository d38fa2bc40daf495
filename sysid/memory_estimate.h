#pragma once
#include "sysid/grid_search.h"

namespace flash::sysid {

/// Memory that a search will take at its peak [bytes].
struct MemoryEstimate {
  double program = 60e6;  ///< itself, with what scoring takes; measured
  double simulation = 0;  ///< solvers and motions in work at once, one candidate a thread
  double kept = 0;        ///< motions over the grid and about its finer mesh, where rollouts are kept
  double total() const { return program + simulation + kept; }
};

/// Before anything is simulated: from vertices, steps and candidates. `solver_check`: whether the answer is
/// solved again, on half the cell too.
MemoryEstimate estimate_memory(const std::vector<Replay>& replays, const GridSettings& settings,
                               bool solver_check);

/// Of this machine [bytes]; 0 where it does not say.
double physical_memory();

}  // namespace flash::sysid
