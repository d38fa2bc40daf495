#pragma once
#include <cuda_runtime.h>

#include "sim/cuda/replay_numbers.h"

namespace flash::sim::cuda {

/// Teams that the device runs at the same time.
int resident_replay_teams(const FrontTables& fronts);

/// Says what of a replay finds room on chip.
void place_on_chip(ReplayNumbers& numbers);

/// Queues the steps first_step to end_step of all environments.
void run_replay(const ReplayNumbers& numbers, int teams, cudaStream_t stream);

}  // namespace flash::sim::cuda
