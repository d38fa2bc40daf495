#pragma once
#include <vector>

#include "sysid/infer/lattice_about.h"

namespace flash::sysid {

enum class Settled { by_emulator, by_points, on_own_mesh, elsewhere };

/// Where folds fall another way between two simulations, a point of the emulator's grid is likelier than the
/// mode of the posterior once that is simulated. The posterior is a mixture: what the mode turned out to be
/// likely, over the likeliest point, is the share of the emulator, and each point speaks for the rest
/// (explore_at_points). A share, since a likelihood of motions that change abruptly differs by chance from
/// point to point: whatever were chosen by it would be as much by chance. The estimate is the mode, or the
/// likeliest point where points have more than half. Where `best` is likely too and its motion far nearer to
/// what was observed, it is the estimate.
/// On the own mesh: its points are likelier than all that is extrapolated to cells of no size, or as likely
/// and the mode is far from likely on that mesh, or the recordings lie there along the error of the mesh, or
/// a motion there is nearer and, by its own measure, likelier than all that is extrapolated. What changes
/// abruptly with the mesh is not extrapolated. Elsewhere: the `best` of the search, beyond the emulator's
/// grid, is likelier than all. `found` is as it was in these two.
Settled settle(const Task& task, Found& found, const std::vector<double>& best,
               const std::vector<KnownError>& held);

/// The posterior by what was simulated alone, on the search's own mesh (explore_at_points). No motion is
/// corrected by what was seen at another.
void keep_to_simulated(const Task& task, Found& found, const std::vector<double>& best,
                       const std::vector<KnownError>& held);

}  // namespace flash::sysid
