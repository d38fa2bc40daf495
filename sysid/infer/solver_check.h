#pragma once
#include <map>
#include <string>
#include <vector>

#include "sysid/emulate/sensitivity.h"
#include "sysid/replay/motion_store.h"

namespace flash::sysid {

/// The best candidate solved once more under finer settings.
struct SolverCheck {
  std::string what;                       ///< "half_step", "double_mesh", "four_times_iterations"
  double score = 0;                       ///< [m]
  double surface_change_m = 0;            ///< mean distance between the two surfaces [m]
  std::map<std::string, double> shift{};  ///< error that the search's own settings cause in each parameter:
                                          ///< of its logarithm where it was searched so, else in its unit
};

/// The candidate at `values` (one an axis of `grid.axes`; they need not be on the grid) simulated as it is
/// ("estimate_itself"), then solved again at half the time step, on a mesh of
/// half the cell (sheets given by a specification only) and with four times the iterations at a tenth of the
/// tolerance. `surface_change_m`: mean over the weighing keyframes of the mean distance from the vertices of
/// the finer run to the surface of the run under the search's own settings, before any registration. `score`:
/// with the registration fitted anew. `shift`: of the parameters, for the search's own settings to move as
/// the finer ones do (see explain); a search of a recording made by the finer solver errs by as much.
std::vector<SolverCheck> check_solver(const std::vector<Replay>& replays, const GridSettings& grid,
                                      const std::vector<double>& values);

/// Half the step and four times the iterations at a candidate of the grid, from the store where it has them.
/// `sensitivity` may be of another mesh and of values nearby.
std::vector<SolverCheck> check_steps(const std::vector<Replay>& replays, const Sensitivity& sensitivity,
                                     const GridSettings& grid, const std::vector<double>& values,
                                     const MotionStore& store);

/// One entry: how far `finer_motions` are from `motions`, and the change of the parameters that explains it.
SolverCheck compare_solutions(const std::string& what, const Sensitivity& sensitivity,
                              const std::vector<Replay>& replays, const std::vector<ReplayResult>& motions,
                              const std::vector<Replay>& finer,
                              const std::vector<ReplayResult>& finer_motions, const GridSettings& grid);

/// Extent of each axis, in the units of Sensitivity.
Eigen::VectorXd ranges_of(const std::vector<Axis>& axes);

}  // namespace flash::sysid
