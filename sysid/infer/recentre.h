#pragma once
#include <optional>
#include <vector>

#include "sysid/infer/lattice_about.h"

namespace flash::sysid {

/// The size of the grasp that the recordings tell, where it is far from that at which motions were simulated:
/// by more than a tenth of what it was assumed to be known to. A patch three millimetres smaller makes D a
/// third higher, which a linear error about the wrong size does not follow. [m]; empty where it is near, or
/// not told.
std::optional<double> told_grasp_size(const Task& task, const Found& found);

/// What was found, about the size of the grasp that the recordings tell: a lattice is simulated anew about
/// another size until it is near, as long as that leads nearer to what was observed. `grid`: that of the
/// task, of which the centres change; `held`: errors by what is held, of the last lattice, and those of the
/// cells.
Found about_told_grasp(const Task& task, Found found, GridSettings& grid, std::vector<KnownError>& held);

}  // namespace flash::sysid
