#pragma once
#include <optional>

#include "sysid/replay/motion_store.h"
#include "sysid/replay/replay.h"

namespace flash::sysid {

/// Time until which the motion of a candidate can be predicted [s]: the first weighing keyframe at which the
/// surfaces of two runs, one with stiffnesses and friction larger by `perturbation`, lie more than `limit`
/// [m] apart in the mean. Empty: to the end. A limp sheet folds, and from then on differences are noise, not
/// information. Both runs are those that `store` keeps.
std::optional<double> predictability_horizon(const Replay& replay, const ReplayCandidate& candidate,
                                             const MotionStore& store, double limit = 1e-3,
                                             double perturbation = 1e-3);

/// Takes the weight from the keyframes at and beyond the horizon, and returns how many had one. Where none
/// would remain, all stay.
int drop_beyond_horizon(std::optional<double> horizon, Replay& replay);

}  // namespace flash::sysid
