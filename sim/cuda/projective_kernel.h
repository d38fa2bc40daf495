#pragma once
#include <cuda_runtime.h>

#include "sim/cuda/projective_numbers.h"

namespace flash::sim::cuda {

/// Decides what stands on chip in a team of so many blocks: places and vectors of solves where there is room
/// for all of them, and with one block as many tiles of the factor as find room.
void place_on_chip(ProjectiveNumbers& numbers, InversePrecision precision, int blocks);

/// Teams of so many blocks that the device works with at the same time.
int resident_projective_teams(const ProjectiveNumbers& numbers, InversePrecision precision, int blocks);

/// Blocks of a team: as many as are worth it while each environment has a team of its own.
int projective_team_blocks(ProjectiveNumbers numbers, InversePrecision precision, int environments);

/// Queues steps of the environments that wait, up to numbers.replay.waiting.end.
void run_projective(const ProjectiveNumbers& numbers, InversePrecision precision, int teams, int blocks,
                    cudaStream_t stream);

}  // namespace flash::sim::cuda
