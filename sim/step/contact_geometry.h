#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <vector>

#include "sim/scene/environment.h"

namespace flash::sim {

/// Depth from which a vertex counts as inside an obstacle at the start of a step, above rounding [m].
inline constexpr double inside_depth = 1e-9;

/// How a point stands against an obstacle.
struct Gap {
  double distance;                ///< to the surface, negative inside [m]
  Eigen::Vector3d normal;         ///< unit, out of the obstacle
  Eigen::Vector3d surface_moved;  ///< motion of the obstacle's material at the contact over the step [m]
  Eigen::Vector3d
      curvature_direction;  ///< sqrt(curvature) times the direction in which the surface is curved [m^-1/2]
  bool starts_inside = false;  ///< whether the vertex starts the step inside
  double sunk = 0;  ///< how far the surface that `distance` is to lies below the obstacle's own [m]
};

/// Where an obstacle stands at the start and at the end of a step.
struct ObstacleMotion {
  Eigen::Isometry3d start = Eigen::Isometry3d::Identity(), end = Eigen::Isometry3d::Identity();
  bool moves = false;
};

std::vector<ObstacleMotion> obstacle_motions(const Environment& environment, double start, double end);

/// Signed distance of `point` [m] to the obstacle where it stands at the end of the step. Exact outside;
/// inside a box the nearest face decides.
Gap gap_to(const Obstacle& obstacle, const ObstacleMotion& motion, const Eigen::Vector3d& point);

/// Signed distance of `point` [m] to the obstacle where it stands at the start of the step.
Gap gap_at_start(const Obstacle& obstacle, const ObstacleMotion& motion, const Eigen::Vector3d& point);

/// The same for each shape.
Gap gap_to(const Plane& plane, const ObstacleMotion& motion, const Eigen::Vector3d& point);
Gap gap_to(const Cylinder& cylinder, const ObstacleMotion& motion, const Eigen::Vector3d& point);
Gap gap_to(const Box& box, const ObstacleMotion& motion, const Eigen::Vector3d& point);

/// Vector from the axis of a cylinder to the point, perpendicular to the axis [m].
Eigen::Vector3d radial_of(const Cylinder& cylinder, const Eigen::Vector3d& point);

/// Gap to the face of a box across `axis`, on the side of `sign`, as if it had no end.
Gap gap_to_face(const Box& box, const ObstacleMotion& motion, const Eigen::Vector3d& point, int axis,
                double sign);

}  // namespace flash::sim
