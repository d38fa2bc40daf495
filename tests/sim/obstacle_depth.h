#pragma once
#include "sim/scene/environment.h"

namespace flash::sim {

/// Depth of a point in an obstacle of the environment as it stands at `time`, negative outside: from the
/// shapes' definitions alone [m].
double depth_in(const Environment& environment, const Obstacle& obstacle, const Eigen::Vector3d& point,
                double time);

}  // namespace flash::sim
