#pragma once
#include <map>
#include <string>
#include <vector>

#include "sysid/emulate/sensitivity.h"
#include "sysid/replay/motion_store.h"

namespace flash::sysid {

/// The estimate under other settings of the solution.
struct SolverCheck {
  std::string what;             ///< "estimate_itself", "half_step", "double_mesh", "four_times_iterations"
  double surface_change_m = 0;  ///< mean distance between the two surfaces [m]
  std::map<std::string, double> shift{};  ///< error that the search's own settings cause in each parameter:
                                          ///< of its logarithm where it was searched so, else in its unit
};

/// Replays under finer settings of the solver.
struct FinerSettings {
  std::string what;  ///< "half_step", "four_times_iterations"
  std::vector<Replay> replays;
};

/// The recordings with a share of the time step, keyframes weighing as they do.
std::vector<Replay> with_step(const std::vector<Replay>& replays, double share);

/// Half the step, and four times the iterations at a tenth of the tolerance.
std::vector<FinerSettings> finer_settings(const std::vector<Replay>& replays);

/// Motions of a candidate under finer settings of the solver.
struct FinerSolution {
  std::string what;
  std::vector<Replay> replays;
  std::vector<ReplayResult> motions;
};

/// From the store where it has them. What diverges is left out.
std::vector<FinerSolution> finer_solutions(std::vector<FinerSettings> settings,
                                           const ReplayCandidate& candidate, const MotionStore& store);

/// The change of each parameter that explains how far `finer_motions` are from `motions`.
std::map<std::string, double> shift_between(const Sensitivity& sensitivity,
                                            const std::vector<Replay>& replays,
                                            const std::vector<ReplayResult>& motions,
                                            const std::vector<Replay>& finer,
                                            const std::vector<ReplayResult>& finer_motions,
                                            const std::vector<Axis>& axes);

/// Mean over the weighing keyframes of all recordings of the mean distance from the vertices of one run to
/// the surface of the other, which is of `replays` [m].
double mean_motion_distance(const std::vector<Replay>& replays, const std::vector<ReplayResult>& motions,
                            const std::vector<ReplayResult>& others);

/// How far `finer_motions` are from `motions`, and the change of the parameters that explains it.
/// `surface_change_m`: their mean_motion_distance, before any registration.
SolverCheck compare_solutions(const std::string& what, const Sensitivity& sensitivity,
                              const std::vector<Replay>& replays, const std::vector<ReplayResult>& motions,
                              const std::vector<Replay>& finer,
                              const std::vector<ReplayResult>& finer_motions, const std::vector<Axis>& axes);

/// Extent of each axis, in the units of Sensitivity.
Eigen::VectorXd ranges_of(const std::vector<Axis>& axes);

}  // namespace flash::sysid
