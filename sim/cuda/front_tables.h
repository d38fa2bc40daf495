#pragma once
#include "sim/cuda/layout/solve_chunk.h"

namespace flash::sim::cuda {

/// A FrontPlan in the memory of a device.
struct FrontTables {
  int size, level_count, shared_panel, vector_size;
  int solve_depth;  ///< chunks of a warp on chip, 1, 2 or 4: while it works on one, the others are on their
                    ///< way
  int factor_tiles;
  long update_size;
  const FrontLayout* fronts;
  const FrontLevel* levels;
  const int* panel_rows;
  const BlockPlace* blocks;
  const SolveChunk* chunks;
  const int* chunk_starts;
  const Gather* gathers;
  const Gather* parted;  ///< SolvePlan::parted
  int parted_count;
};

}  // namespace flash::sim::cuda
