#include "sysid/replay/mark.h"

#include <Eigen/Geometry>

namespace flash::sysid {
namespace {

/// First edge, across it, normal.
Eigen::Matrix3d frame_of(const Eigen::Matrix3d& corners) {
  const Eigen::Vector3d first = corners.col(1) - corners.col(0), second = corners.col(2) - corners.col(0);
  Eigen::Matrix3d frame;
  frame.col(0) = first.normalized();
  frame.col(2) = first.cross(second).normalized();
  frame.col(1) = frame.col(2).cross(frame.col(0));
  return frame;
}

/// By what the unit vector along `vector` moves with it.
Eigen::Vector3d direction_shift(const Eigen::Vector3d& vector, const Eigen::Vector3d& moved) {
  const Eigen::Vector3d unit = vector.normalized();
  return (moved - unit * unit.dot(moved)) / vector.norm();
}

Eigen::Vector3d mean(const Eigen::Matrix3d& corners, const Eigen::Vector3d& barycentric) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (int k = 0; k < 3; ++k) sum += barycentric[k] * corners.col(k);
  return sum;
}

}  // namespace

Mark put_mark(const Eigen::Vector3d& place, const data::TriangleMesh& rest, const SurfacePoint& nearest) {
  constexpr double kOn = 1e-9;  // From the surface [m]. Work: rounding.
  Mark mark{nearest.triangle, nearest.barycentric};
  if (nearest.distance > kOn)
    mark.offset = frame_of(corners_of(rest.vertices, rest.triangles, nearest.triangle)).transpose() *
                  (place - nearest.position);
  return mark;
}

Eigen::Vector3d mark_position(const Mark& mark, const Eigen::Matrix3d& corners) {
  const Eigen::Vector3d point = mean(corners, mark.barycentric);
  if (mark.offset.isZero(0)) return point;
  return point + frame_of(corners) * mark.offset;
}

Eigen::Vector3d mark_shift(const Mark& mark, const Eigen::Matrix3d& corners, const Eigen::Matrix3d& moved) {
  const Eigen::Vector3d point = mean(moved, mark.barycentric);
  if (mark.offset.isZero(0)) return point;
  const Eigen::Matrix3d frame = frame_of(corners);
  const Eigen::Vector3d first = corners.col(1) - corners.col(0), second = corners.col(2) - corners.col(0),
                        first_moved = moved.col(1) - moved.col(0), second_moved = moved.col(2) - moved.col(0);
  const Eigen::Vector3d along = direction_shift(first, first_moved),
                        normal = direction_shift(first.cross(second),
                                                 first_moved.cross(second) + first.cross(second_moved));
  const Eigen::Vector3d across = normal.cross(frame.col(0)) + frame.col(2).cross(along);
  return point + mark.offset[0] * along + mark.offset[1] * across + mark.offset[2] * normal;
}

Eigen::Matrix3d corners_of(const data::Points& positions, const data::Triangles& triangles, int triangle) {
  Eigen::Matrix3d corners;
  for (int k = 0; k < 3; ++k) corners.col(k) = positions.row(triangles(triangle, k)).transpose();
  return corners;
}

}  // namespace flash::sysid
