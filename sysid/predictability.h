#pragma once
#include <optional>
#include <vector>

#include "sysid/grid_results.h"
#include "sysid/replay.h"

namespace flash::sysid {

/// Time until which the motion of a candidate can be predicted [s]: the first weighing keyframe at which the
/// surfaces of two runs, one with stiffnesses and friction larger by `perturbation`, lie more than `limit`
/// [m] apart in the mean. Empty: to the end. A limp sheet folds, and from then on differences are noise, not
/// information.
std::optional<double> predictability_horizon(const Replay& replay, const ReplayCandidate& candidate,
                                             double limit = 1e-3, double perturbation = 1e-3);

/// Takes the weight from the keyframes at and beyond each recording's horizon and forms the scores of all
/// candidates anew from the keyframes that remain. Where none would remain, a recording keeps its own.
void drop_beyond_horizons(const std::vector<std::optional<double>>& horizons, GridResults& results);

/// The same for the observations of one recording.
void drop_beyond_horizon(std::optional<double> horizon, Replay& replay);

}  // namespace flash::sysid
