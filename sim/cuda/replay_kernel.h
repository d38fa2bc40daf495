#pragma once
#include <cuda_runtime.h>

#include "sim/cuda/replay_numbers.h"

namespace flash::sim::cuda {

/// Teams of so many blocks that the device runs at the same time.
int resident_replay_teams(const FrontTables& fronts, int blocks);

/// Blocks of a team, as many as the device has processors for when so many environments run at once.
int team_blocks_for(const FrontTables& fronts, int environments);

/// Says what of a replay with teams of so many blocks finds room on chip.
void place_on_chip(ReplayNumbers& numbers, int blocks);

/// Queues the steps first_step to end_step of all environments, on teams of so many blocks.
void run_replay(const ReplayNumbers& numbers, int teams, int blocks, cudaStream_t stream);

}  // namespace flash::sim::cuda
