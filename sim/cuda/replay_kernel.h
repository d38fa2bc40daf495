#pragma once
#include <cuda_runtime.h>

#include "sim/cuda/replay_numbers.h"

namespace flash::sim::cuda {

/// Teams of so many blocks that the device runs at the same time.
int resident_replay_teams(const FrontTables& fronts, int blocks);

/// Says what of a replay with teams of so many blocks finds room on chip.
void place_on_chip(ReplayNumbers& numbers, int blocks);

/// Queues the steps of the environments that wait, on teams of so many blocks.
void run_replay(const ReplayNumbers& numbers, int teams, int blocks, cudaStream_t stream);

}  // namespace flash::sim::cuda
