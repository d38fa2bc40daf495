#pragma once
#include <cuda_runtime.h>

#include "sim/cuda/replay_numbers.h"

namespace flash::sim::cuda {

/// Teams that the device runs at the same time, on which the queue of a replay relies.
int resident_replay_teams(FactorPrecision precision, const FrontTables& fronts);

/// Whether the places of a sheet find room on chip.
bool replay_has_places_on_chip(const FrontTables& fronts);

/// Queues the steps first_step to end_step of all environments.
void run_replay(FactorPrecision precision, const ReplayNumbers& numbers, int teams, cudaStream_t stream);

}  // namespace flash::sim::cuda
