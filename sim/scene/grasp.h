#pragma once
#include "sim/scene/environment.h"

namespace flash::sim {

/// Closes and opens the grasps for the step that ends at `time` [s]: a grasp that closes takes over where its
/// vertices are in the gripper, one that opens forgets it (environment.state.grasp_offsets).
void update_grasps(Environment& environment, double time);

}  // namespace flash::sim
