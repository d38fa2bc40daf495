#pragma once
#include <optional>
#include <string>
#include <vector>

#include "sysid/replay/replay.h"

namespace flash::sysid {

/// Edge length of equilateral triangles as large as those in which a point of a sheet lies on average [m].
double typical_cell(const data::TriangleMesh& mesh);

/// A sheet that a gripper lifts off a table leaves it in a fold of about the radius
///
///     (D / (rho g))^(1/3),
///
/// rho the areal density: its bending length (Peirce 1930). Where cells take more than half of that, their
/// error does not fall by the second order from the first halving on.
struct CoarseCells {
  double cell = 0, radius = 0;  ///< [m]
};

/// Of the first recording in which they are; empty where there is none: cells are smaller, or there is no
/// table, no weight, no bending or a solid.
std::optional<CoarseCells> coarse_cells(const std::vector<Replay>& replays, const ReplayCandidate& candidate);

/// The bending rigidity below which cells of a recording are coarse, of the heaviest candidate [N m]; 0 where
/// they never are.
double coarse_below(const Replay& replay, const ReplayCandidate& heaviest);

/// What a warning says of them.
std::string coarse_cells_text(const CoarseCells& coarse);

}  // namespace flash::sysid
