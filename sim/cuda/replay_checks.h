#pragma once
#include "sim/cuda/batch_replay.h"

namespace flash::sim::cuda {

/// Throws std::invalid_argument, which says `what`, unless it is met.
void require(bool met, const char* what);

/// Throws std::invalid_argument as BatchReplay's constructor does.
void check_replay(const SheetPlan& plan, const std::vector<ReplayEnvironment>& environments,
                  const ReplaySettings& settings);

}  // namespace flash::sim::cuda
