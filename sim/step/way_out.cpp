#include "sim/step/way_out.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace flash::sim {

using Eigen::Vector3d;

namespace {

void add_directions(const Obstacle& obstacle, const ObstacleMotion& motion,
                    std::vector<Vector3d>& directions) {
  if (const auto* plane = std::get_if<Plane>(&obstacle.shape)) {
    directions.push_back(plane->normal);
  } else if (const auto* cylinder = std::get_if<Cylinder>(&obstacle.shape)) {
    constexpr int count = 16;
    const Vector3d x = cylinder->axis.unitOrthogonal(), y = cylinder->axis.cross(x);
    for (int k = 0; k < count; ++k) {
      const double angle = 2 * std::numbers::pi * k / count;
      directions.push_back(std::cos(angle) * x + std::sin(angle) * y);
    }
  } else {
    for (int axis = 0; axis < 3; ++axis)
      for (const double sign : {1.0, -1.0}) directions.push_back(sign * motion.start.linear().col(axis));
  }
}

}  // namespace

Vector3d common_way_out(const Environment& environment, const std::vector<ObstacleMotion>& motions,
                        const std::vector<std::vector<int>>& inside) {
  std::vector<Vector3d> directions;
  for (std::size_t k = 0; k < motions.size(); ++k)
    if (!inside[k].empty()) add_directions(environment.obstacles[k], motions[k], directions);
  Vector3d best = Vector3d::Zero();
  double shortest = std::numeric_limits<double>::infinity();
  for (const Vector3d& direction : directions) {
    double longest = 0;
    for (std::size_t k = 0; k < motions.size(); ++k)
      for (const int i : inside[k])
        longest = std::max(longest, depth_along(environment.obstacles[k], motions[k],
                                                environment.state.positions.row(i), direction));
    if (longest < shortest) {
      shortest = longest;
      best = direction;
    }
  }
  return best;
}

}  // namespace flash::sim
