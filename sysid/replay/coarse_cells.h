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

inline constexpr double most_of_fold = 0.5;  // Of its radius. Measured: as next (docs/validation/grasp.md).

/// The share that cells of an answer take where they are made for the fold, and that from which on they are.
/// Measured: on these cells the three worst misses of D hold (docs/validation/grasp.md).
inline constexpr double made_for_fold = 0.375, most_of_fold_of_answer = 1.05 * made_for_fold;

/// Of the first recording in which they take more than `most` of the radius; empty where there is none: cells
/// are smaller, or there is no table, no weight, no bending or a solid.
std::optional<CoarseCells> coarse_cells(const std::vector<Replay>& replays, const ReplayCandidate& candidate,
                                        double most = most_of_fold);

/// The bending rigidity below which cells of a recording take more than `most` of the radius, of the heaviest
/// candidate [N m]; 0 where they never do.
double coarse_below(const Replay& replay, const ReplayCandidate& heaviest, double most = most_of_fold);

/// What a warning says of them.
std::string coarse_cells_text(const CoarseCells& coarse);

/// The recordings on cells that take three eighths of the radius of that fold, or half of what they are where
/// that is more; empty where theirs are as small, or layers of the sheet meet. At half of the radius a search
/// is off by some percent more than it says, at three eighths the error of its cells falls by the second
/// order.
std::vector<Replay> on_cells_for_fold(const std::vector<Replay>& replays, const ReplayCandidate& candidate);

/// What an answer says that is of these in place of those of its search.
std::string cells_for_fold_text(const std::vector<Replay>& replays, const std::vector<Replay>& smaller);

}  // namespace flash::sysid
