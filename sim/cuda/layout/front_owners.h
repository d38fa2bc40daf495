#pragma once
#include <vector>

#include "sim/cuda/layout/front_plan.h"

namespace flash::sim::cuda {

/// The owner of a front on which all blocks of a team work.
inline constexpr int all_blocks = -1;

/// Which block of a team solves a front alone, and with it all that it comes from: trees of about the same
/// work below as few fronts as there have to be that all blocks share. A block waits for others at those
/// alone.
std::vector<int> front_owners(const FrontPlan& fronts, int team_blocks);

}  // namespace flash::sim::cuda
