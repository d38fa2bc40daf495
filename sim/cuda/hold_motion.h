#pragma once
#include "sim/cuda/batch_replay.h"
#include "sim/scene/environment.h"

namespace flash::sim::cuda {

/// How many of the next `most` steps of `time_step` [s] the holds of an environment can be told of: those
/// before another hold closes. It takes vertices from where they are then.
int steps_before_a_hold_closes(const Environment& environment, double time_step, int most);

/// Whether a hold closes in the next step of `time_step` [s]: it takes vertices from where they are.
bool closes_next(const Environment& environment, double time_step);

/// What the holds carry in the next steps, which steps_before_a_hold_closes allows. environment.state.held
/// becomes that at their end, as update_holds has it; the rest of the state stays.
HoldMotion motion_of_holds(Environment& environment, double time_step, int steps);

/// The springs of soft holds in the same steps; null where no hold is soft.
std::shared_ptr<const SpringMotions> motion_of_springs(Environment environment, double time_step, int steps);

/// An environment as the device takes it. It is to hold `holds` and `springs`.
ReplayEnvironment replay_environment(const Environment& environment, std::shared_ptr<const HoldMotion> holds,
                                     std::shared_ptr<const SpringMotions> springs = {});

}  // namespace flash::sim::cuda
