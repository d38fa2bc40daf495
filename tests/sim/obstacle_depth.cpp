#include "tests/sim/obstacle_depth.h"

#include <algorithm>

namespace flash::sim {

using Eigen::Isometry3d;
using Eigen::Vector3d;

double depth_in(const Environment& environment, const Obstacle& obstacle, const Vector3d& point,
                double time) {
  if (const auto* plane = std::get_if<Plane>(&obstacle.shape))
    return -plane->normal.dot(point - plane->point);
  if (const auto* cylinder = std::get_if<Cylinder>(&obstacle.shape))
    return cylinder->radius - (point - cylinder->point).cross(cylinder->axis).norm();
  if (const auto* capsule = std::get_if<Capsule>(&obstacle.shape)) {
    const Vector3d out = frame_pose(environment, obstacle.frame, time).inverse() * point - capsule->centre;
    const double along = std::clamp(out.dot(capsule->axis), -capsule->half_length, capsule->half_length);
    return capsule->radius - (out - along * capsule->axis).norm();
  }
  const Box& box = std::get<Box>(obstacle.shape);
  const Isometry3d pose = frame_pose(environment, obstacle.frame, time) * box.pose;
  return (box.half_extents - (pose.inverse() * point).cwiseAbs()).minCoeff();
}

}  // namespace flash::sim
