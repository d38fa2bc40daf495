#pragma once
#include <optional>
#include <string>
#include <vector>

#include "sysid/replay/replay.h"

namespace flash::sysid {

/// The same recording on cells of half the size, keyframes weighing as they do: meshed anew by its
/// specification, or the tetrahedra of a file split. Empty for a sheet from a file, and in a shape of its
/// own.
Replay on_half_the_cell(const Replay& replay);

std::vector<Replay> on_half_the_cell(const std::vector<Replay>& replays);

/// The same recordings on smaller cells, those at the grasps smaller by as much: their cell_scale times the
/// factor, or halved where one of them does not take any cell.
std::vector<Replay> on_smaller_cells(const std::vector<Replay>& replays, double factor);

/// Replays before and after all cells that are not at the grasps were halved: those at the grasps have the
/// same size in both.
struct HalvedSheet {
  std::vector<Replay> before, after;
};

/// Whether the cells of all replays shrink towards grasps, so that on_half_the_cell leaves those of the sheet
/// as they are.
bool are_graded(const std::vector<Replay>& replays);

/// The cells of the sheet of graded replays halved so many times, at least once: of the cells of the replays,
/// of the halves. `before` of the first time is halfway to on_half_the_cell.
HalvedSheet halved_sheet(const std::vector<Replay>& replays, int times);

}  // namespace flash::sysid
