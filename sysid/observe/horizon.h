#pragma once
#include <optional>
#include <string>
#include <vector>

#include "sysid/replay/motion_store.h"
#include "sysid/replay/replay.h"

namespace flash::sysid {

/// A candidate that differs from another in one parameter, by a little.
struct NearbyCandidate {
  std::string parameter;
  ReplayCandidate candidate;
};

/// Time until which a motion can be predicted, and the parameter whose change parts it first.
struct Horizon {
  double t = 0;  ///< [s]
  std::string parameter;
};

/// Of each replay the first weighing keyframe at which the surface of a candidate and that of one nearby lie
/// more than `limit` [m] apart in the mean; of several that part there, the one that parts most. Empty: to
/// the end. A limp sheet folds, and from then on differences are noise, not information. All runs are those
/// that `store` keeps, simulated side by side.
std::vector<std::optional<Horizon>> predictability_horizons(const std::vector<Replay>& replays,
                                                            const ReplayCandidate& candidate,
                                                            const std::vector<NearbyCandidate>& nearby,
                                                            const MotionStore& store, double limit = 1e-3);

/// Takes the weight from the keyframes at and beyond the horizon [s], and returns how many had one. Where
/// none would remain, all stay.
int drop_beyond_horizon(std::optional<double> horizon, Replay& replay);

}  // namespace flash::sysid
