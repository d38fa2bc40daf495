#pragma once
#include "sim/cuda/layout/solve_chunk.h"

namespace flash::sim::cuda {

/// A FrontPlan in the memory of a device.
struct FrontTables {
  int size, level_count, shared_panel, vector_size;
  int solve_depth;  ///< chunks of a warp on chip, 1 or 2: while it works on one, the next is on its way
  long factor_size, update_size;
  const FrontLayout* fronts;
  const FrontLevel* levels;
  const int *panel_rows, *entries;
  const BlockPlace* blocks;
  const SolveChunk* chunks;
  const int* chunk_starts;
  const Gather* gathers;
};

}  // namespace flash::sim::cuda
