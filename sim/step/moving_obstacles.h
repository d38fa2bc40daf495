#pragma once
#include <Eigen/Core>
#include <vector>

#include "sim/law/obstacle_step.h"
#include "sim/law/rigid_frame.h"
#include "sim/law/symmetric3.h"
#include "sim/scene/environment.h"

namespace flash::sim {

inline Vector3<double> vector3(const data::Points& rows, Eigen::Index i) {
  return {rows(i, 0), rows(i, 1), rows(i, 2)};
}
inline Eigen::Vector3d vector3d(const Vector3<double>& v) { return {v.x, v.y, v.z}; }
inline Eigen::Matrix3d matrix3d(const Symmetric3& a) {
  return (Eigen::Matrix3d() << a.xx, a.xy, a.xz, a.xy, a.yy, a.yz, a.xz, a.yz, a.zz).finished();
}

/// How a point stands against an obstacle, as SurfaceGap says.
struct Gap {
  double distance;  ///< [m]
  Eigen::Vector3d normal, surface_moved, curvature_direction;
  double ball_curvature;  ///< [1/m]
  bool starts_inside;
  double sunk;  ///< [m]
};
Gap gap_of(const SurfaceGap<double>& gap);

/// An obstacle as it stands in the frame that carries it, in both of its frames. `friction`: on the body at
/// hand.
MovingObstacle<double> obstacle_in_frame(const Obstacle& obstacle, double friction);

/// Whether a box stands beside another obstacle, so that one may continue the other.
bool stand_beside(const std::vector<Obstacle>& obstacles);

/// As how many obstacles a vertex may meet it at once: a mesh by several surfaces.
int surfaces_of(const Obstacle& obstacle);

/// The obstacles of an environment between the times `start` and `end` [s], with the friction on its first
/// body.
std::vector<MovingObstacle<double>> moving_obstacles(const Environment& environment, double start,
                                                     double end);

}  // namespace flash::sim
