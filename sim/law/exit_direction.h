#pragma once
#include <cmath>
#include <numbers>

#include "sim/law/obstacle_step.h"

namespace flash::sim {
inline namespace FLASH_LEVEL {

/// Of the exit speed, where a sheet cannot leave at all of it.
inline constexpr double slow_exit_share = 0.125;

/// How many directions there are in which a sheet may leave an obstacle as a whole.
FLASH_HOST_DEVICE inline int exit_directions(const MovingObstacle<double>& obstacle) {
  switch (obstacle.shape) {
    case ObstacleShape::plane:
      return 1;
    case ObstacleShape::box:
      return 6;
    case ObstacleShape::cylinder:
      return 16;
    case ObstacleShape::capsule:
    case ObstacleShape::mesh:
      break;
  }
  return 26;
}

/// The k-th of them: out of a plane, out of the faces of a box, across the axis of a cylinder, out of a
/// capsule or a mesh to the neighbours of a cell among 27.
FLASH_HOST_DEVICE inline Vector3<double> exit_direction(const MovingObstacle<double>& obstacle, int k) {
  const Frame<double>& frame = obstacle.start;
  if (obstacle.shape == ObstacleShape::plane) return frame.z;
  if (obstacle.shape == ObstacleShape::box) return (k % 2 == 0 ? 1.0 : -1.0) * frame.axis(k / 2);
  if (obstacle.shape == ObstacleShape::capsule || obstacle.shape == ObstacleShape::mesh) {
    const int cell = k < 13 ? k : k + 1;  // without that in the middle
    const Vector3<double> way = {cell % 3 - 1.0, cell / 3 % 3 - 1.0, cell / 9 - 1.0};  // NOLINT
    return direction_from(frame, (1 / norm(way)) * way);
  }
  const double angle = 2 * std::numbers::pi * k / exit_directions(obstacle);
  return std::cos(angle) * frame.x + std::sin(angle) * frame.y;
}

}  // namespace FLASH_LEVEL
}  // namespace flash::sim
