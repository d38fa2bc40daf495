#pragma once
#include <Eigen/Core>
#include <span>
#include <vector>

#include "sim/law/freedom.h"

namespace flash::sim {

/// A vertex against an obstacle.
struct Touch {
  int obstacle = -1;
  bool holds = false;          ///< the vertex stays on it
  bool released = false;       ///< in this iterate's linear problem, where the surface would have had to pull
  double gap = 0.0;            ///< [m]
  bool starts_inside = false;  ///< whether the vertex starts the step inside
  double friction_coefficient = 0;  ///< mu of the obstacle on this vertex
  double normal_force = 0;          ///< lambda_n of an obstacle that holds [N]
  double slip = 0.0;                ///< length of the slip against it in this step, as friction takes it [m]
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  Eigen::Vector3d curvature_direction = Eigen::Vector3d::Zero();  ///< as in Gap [m^-1/2]
  Eigen::Vector3d surface_moved = Eigen::Vector3d::Zero();        ///< motion of the surface over the step [m]
  Eigen::Vector3d slip_direction =
      Eigen::Vector3d::Zero();                         ///< slip of the vertex on this surface over `slip`
  Eigen::Vector3d friction = Eigen::Vector3d::Zero();  ///< friction force of the surface on the vertex [N]

  bool touches() const { return gap <= touching_gap; }
};

/// Sets `normal_force` and `holds` of the eligible touches to the non-negative forces of least squares for
/// `needed` [N], without friction between the surfaces. Those of all others become zero.
void share_force(std::span<Touch> touches, const Eigen::Vector3d& needed, bool (*eligible)(const Touch&));

/// Shares the force among surfaces that each rub against the vertex's own slip: the reaction is the sum of
/// lambda_k (n_k - mu_k d_k).
void share_force_rubbing(std::span<Touch> touches, const Eigen::Vector3d& needed,
                         bool (*eligible)(const Touch&));

/// Projector on the directions along all surfaces that hold the vertex: space without any, a plane, the edge
/// of two, or nothing.
Eigen::Matrix3d along_surfaces(std::span<const Touch> touches);

}  // namespace flash::sim
