#pragma once
#include <vector>

#include "sim/cuda/layout/front_plan.h"
#include "sim/cuda/layout/solve_chunk.h"

namespace flash::sim::cuda {

/// How the warps of a team share a solve: each goes through chunks of its own, first all heights upwards and
/// then downwards. Which numbers a warp needs does not depend on the right-hand side, so that they can be on
/// their way long before.
struct SolvePlan {
  std::vector<SolveChunk> chunks;  ///< of one warp after the other
  std::vector<int> starts;         ///< of each warp, and the end
  /// By rows of fronts as FrontPlan::entries: what children pass up to it, then, from `entries` on, the parts
  /// of its entry.
  std::vector<Gather> gathers;
  int entries = 0;
  /// Numbers of the solution that come in two parts, which are added up at last: where that of the solution
  /// is, and the other one.
  std::vector<Gather> parted;
  int vector_size = 0;  ///< numbers that a solve works on (solve_chunk.h)
};

/// For a team of so many blocks. What is added up to a number does not depend on how many there are. Of what
/// is on chip each block has a copy; each solves fronts of its own (front_owners.h) until all blocks share
/// some.
SolvePlan plan_solve(const FrontPlan& fronts, int team_blocks = 1);

}  // namespace flash::sim::cuda
