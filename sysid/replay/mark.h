#pragma once
#include <Eigen/Core>

#include "data/mesh/mesh.h"
#include "sysid/replay/surface_distance.h"

namespace flash::sysid {

/// Where a mark was put: at a point of the surface, or off it, as on a stiff stalk that stands there. The
/// stalk turns with its triangle: with the normal, and the first edge about it.
struct Mark {
  int triangle = -1;
  Eigen::Vector3d barycentric = Eigen::Vector3d::Zero();  ///< weights of the triangle's corners, sum 1
  /// From that point, along the first edge, across it in the triangle, and along the normal [m].
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();
};

/// The mark at a place on the surface at rest, or beside it. Within a nanometre counts as on it.
Mark put_mark(const Eigen::Vector3d& place, const data::TriangleMesh& rest, const SurfacePoint& nearest);

/// Where the mark is when the corners of its triangle are at the columns [m].
Eigen::Vector3d mark_position(const Mark& mark, const Eigen::Matrix3d& corners);

/// By what it moves with them, to first order: `moved` is of the corners.
Eigen::Vector3d mark_shift(const Mark& mark, const Eigen::Matrix3d& corners, const Eigen::Matrix3d& moved);

/// The corners of a triangle, a column each.
Eigen::Matrix3d corners_of(const data::Points& positions, const data::Triangles& triangles, int triangle);

}  // namespace flash::sysid
