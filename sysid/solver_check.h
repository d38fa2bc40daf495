#pragma once
#include <vector>

#include "sysid/grid_search.h"
#include "sysid/summary.h"

namespace flash::sysid {

/// The candidate at `values` (one an axis of `grid.axes`; they need not be on the grid) simulated as it is
/// ("estimate_itself"), then solved again at half the time step, on a mesh of
/// half the cell (sheets given by a specification only) and with four times the iterations at a tenth of the
/// tolerance. `surface_change_m`: mean over the weighing keyframes of the mean distance from the vertices of
/// the finer run to the surface of the run under the search's own settings, before any registration. `score`:
/// with the registration fitted anew. `shift`: of the parameters, for the search's own settings to move as
/// the finer ones do (see explain); a search of a recording made by the finer solver errs by as much.
std::vector<SolverCheck> check_solver(const std::vector<Replay>& replays, const GridSettings& grid,
                                      const std::vector<double>& values);

}  // namespace flash::sysid
