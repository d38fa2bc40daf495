#pragma once
#include <utility>
#include <vector>

#include "sysid/replay/replay.h"

namespace flash::sysid {

/// Mean distance of the vertices of motion `b` to the surface of motion `a`, in the frame of the simulation,
/// at each keyframe that weighs: (t [s], distance [m]). `a` is of the replay's mesh, `b` of any.
std::vector<std::pair<double, double>> motion_distance(const Replay& replay, const Motion& a,
                                                       const Motion& b);

}  // namespace flash::sysid
