#pragma once
#include <Eigen/Core>

#include "sim/environment.h"

namespace flash::sim {

/// Where a point stands against an obstacle.
struct Gap {
  double distance;                ///< to the surface, negative inside [m]
  Eigen::Vector3d normal;         ///< unit, out of the obstacle
  Eigen::Vector3d surface_moved;  ///< by the obstacle's material at the contact, over the step [m]
  Eigen::Vector3d curved;  ///< sqrt(curvature) times the direction in which the surface is curved [m^-1/2]
};

/// Signed distance of `point` [m] to the obstacle at `time` [s], the end of a step of `time_step`. Exact
/// outside; inside a box the nearest face decides.
Gap gap_to(const Obstacle& obstacle, const Eigen::Vector3d& point, double time, double time_step);

}  // namespace flash::sim
