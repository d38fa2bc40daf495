#pragma once
#include "sim/scene/environment.h"

namespace flash::sim {

/// Closes and opens the grasps for the step that ends at `time` [s]. A grasp that closes stores where its
/// vertices are in the gripper, in environment.state.grasp_offsets; one that opens forgets it.
void update_grasps(Environment& environment, double time);

}  // namespace flash::sim
