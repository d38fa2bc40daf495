#pragma once
#include "sim/cuda/device_arena.h"
#include "sim/cuda/layout/sheet_layout.h"
#include "sim/cuda/replay_numbers.h"

namespace flash::sim::cuda {

/// What a team of a replay needs memory for, with whatever holds and materials come.
struct TeamSizes {
  const FrontTables& fronts;
  const SheetLayout& layout;
  int hinges;  ///< of the plan: a material may come that has them
  int most_obstacles;
};

/// The memory of a team as parts of a piece that the arena hands out.
TeamMemory lay_out_team(const TeamSizes& sizes, DeviceArena& arena);

}  // namespace flash::sim::cuda
