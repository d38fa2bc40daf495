#include "sim/step/contact_geometry.h"

#include <cmath>

namespace flash::sim {

using Eigen::Vector3d;

namespace {

/// How far the material of a box at `point` has moved in the step.
Vector3d moved_by(const ObstacleMotion& motion, const Vector3d& point, const Vector3d& local) {
  return motion.moves ? Vector3d(point - motion.start * local) : Vector3d::Zero();
}

ObstacleMotion motion_of(const Environment& environment, const Obstacle& obstacle, double start, double end) {
  ObstacleMotion motion;
  const Box* box = std::get_if<Box>(&obstacle.shape);
  if (box == nullptr) return motion;
  motion.moves = box->frame != base_frame;
  motion.start = frame_pose(environment, box->frame, start) * box->pose;
  motion.end = frame_pose(environment, box->frame, end) * box->pose;
  return motion;
}

}  // namespace

Gap gap_to(const Plane& plane, const ObstacleMotion&, const Vector3d& point) {
  return {plane.normal.dot(point - plane.point), plane.normal, Vector3d::Zero(), Vector3d::Zero()};
}

Vector3d radial_of(const Cylinder& cylinder, const Vector3d& point) {
  const Vector3d radial = point - cylinder.point;
  return radial - cylinder.axis * cylinder.axis.dot(radial);
}

Gap gap_to(const Cylinder& cylinder, const ObstacleMotion&, const Vector3d& point) {
  const Vector3d radial = radial_of(cylinder, point);
  const double length = radial.norm();
  if (length == 0)
    return {-cylinder.radius, cylinder.axis.unitOrthogonal(), Vector3d::Zero(), Vector3d::Zero()};
  const Vector3d normal = radial / length;
  return {length - cylinder.radius, normal, Vector3d::Zero(),
          cylinder.axis.cross(normal) / std::sqrt(length)};
}

Gap gap_to_face(const Box& box, const ObstacleMotion& motion, const Vector3d& point, int axis, double sign) {
  const Vector3d local = motion.end.inverse(Eigen::Isometry) * point;
  return {sign * local[axis] - box.half_extents[axis], sign * motion.end.linear().col(axis),
          moved_by(motion, point, local), Vector3d::Zero()};
}

Gap gap_to(const Box& box, const ObstacleMotion& motion, const Vector3d& point) {
  const Vector3d local = motion.end.inverse(Eigen::Isometry) * point;
  const Vector3d excess = local.cwiseAbs() - box.half_extents;
  if (excess.maxCoeff() <= 0) {
    int axis;
    excess.maxCoeff(&axis);
    return gap_to_face(box, motion, point, axis, std::copysign(1.0, local[axis]));
  }
  const Vector3d outside = excess.cwiseMax(0.0).cwiseProduct(local.cwiseSign());
  const double distance = outside.norm();
  return {distance, motion.end.linear() * (outside / distance), moved_by(motion, point, local),
          Vector3d::Zero()};
}

std::vector<ObstacleMotion> obstacle_motions(const Environment& environment, double start, double end) {
  std::vector<ObstacleMotion> motions;
  for (const Obstacle& obstacle : environment.obstacles)
    motions.push_back(motion_of(environment, obstacle, start, end));
  return motions;
}

Gap gap_to(const Obstacle& obstacle, const ObstacleMotion& motion, const Vector3d& point) {
  return std::visit([&](const auto& shape) { return gap_to(shape, motion, point); }, obstacle.shape);
}

Gap gap_at_start(const Obstacle& obstacle, const ObstacleMotion& motion, const Vector3d& point) {
  ObstacleMotion still = motion;
  still.end = still.start;
  return gap_to(obstacle, still, point);
}

}  // namespace flash::sim
