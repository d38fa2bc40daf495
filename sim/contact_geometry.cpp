#include "sim/contact_geometry.h"

#include <cmath>

namespace flash::sim {

namespace {

using Eigen::Vector3d;

Gap gap_of(const Plane& plane, const Vector3d& point, double, double) {
  return {plane.normal.dot(point - plane.point), plane.normal, Vector3d::Zero(), Vector3d::Zero()};
}

Gap gap_of(const Cylinder& cylinder, const Vector3d& point, double, double) {
  Vector3d radial = point - cylinder.point;
  radial -= cylinder.axis * cylinder.axis.dot(radial);
  const double length = radial.norm();
  if (length == 0)
    return {-cylinder.radius, cylinder.axis.unitOrthogonal(), Vector3d::Zero(), Vector3d::Zero()};
  const Vector3d normal = radial / length;
  return {length - cylinder.radius, normal, Vector3d::Zero(),
          cylinder.axis.cross(normal) / std::sqrt(length)};
}

Gap gap_of(const Box& box, const Vector3d& point, double time, double time_step) {
  const Eigen::Isometry3d pose =
      box.trajectory.times.empty() ? box.pose : data::pose_at(box.trajectory, time);
  const Vector3d local = pose.inverse() * point;
  const Vector3d excess = local.cwiseAbs() - box.half_extents;
  Gap gap;
  if (excess.maxCoeff() <= 0) {
    int axis;
    gap.distance = excess.maxCoeff(&axis);
    gap.normal = pose.linear() * (Vector3d::Unit(axis) * std::copysign(1.0, local[axis]));
  } else {
    const Vector3d outside = excess.cwiseMax(0.0).cwiseProduct(local.cwiseSign());
    gap.distance = outside.norm();
    gap.normal = pose.linear() * (outside / gap.distance);
  }
  gap.surface_moved = gap.curved = Vector3d::Zero();
  if (!box.trajectory.times.empty())
    gap.surface_moved = point - data::pose_at(box.trajectory, time - time_step) * local;
  return gap;
}

}  // namespace

Gap gap_to(const Obstacle& obstacle, const Vector3d& point, double time, double time_step) {
  return std::visit([&](const auto& shape) { return gap_of(shape, point, time, time_step); }, obstacle.shape);
}

}  // namespace flash::sim
