#pragma once
#include <Eigen/Core>
#include <vector>

#include "sim/environment.h"

namespace flash::sim {

/// What a vertex may do in a step.
enum class Hold {
  free,
  fixed,  ///< some axes held, by a support or a gripper
  slip,   ///< on a surface, the friction force on the rim of its cone
  stick,  ///< on a surface, at rest against it
};

/// The constraint on one vertex at the current iterate of a step.
struct VertexConstraint {
  Hold hold = Hold::free;
  int grasp = -1;                                         ///< which grasp holds it
  int obstacle = -1;                                      ///< which obstacle it touches
  Eigen::Matrix3d free = Eigen::Matrix3d::Identity();     ///< projector on the directions it may still move in
  Eigen::Vector3d correction = Eigen::Vector3d::Zero();   ///< displacement that the constraint demands [m]
  Eigen::Vector3d reaction = Eigen::Vector3d::Zero();     ///< force on the vertex, always admissible [N]
  Eigen::Matrix3d stiffness = Eigen::Matrix3d::Zero();    ///< derivative of the slip friction, positive semi-definite [N/m]
  double gap = 0.0;                                       ///< to the nearest obstacle [m]
  double friction_bound = 0.0;                            ///< mu lambda_n of a slipping vertex [N]
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();       ///< of the nearest obstacle
  Eigen::Vector3d slip_direction = Eigen::Vector3d::Zero();  ///< unit, last direction of slip; zero before any
  int changes = 0;                                        ///< of `hold` in this step
};

/// Constraints at the start of a step: held vertices by the environment's supports and grasps at `time`, contacts by
/// where the step starts from. Moves held vertices of `positions` to where they have to be.
std::vector<VertexConstraint> begin_step(const Environment& environment, double time, data::Points& positions);

/// One update of the primal-dual active set (Hueber, Wohlmuth 2005; friction as Hueber, Stadler, Wohlmuth 2008). `force`
/// is what each vertex needs from outside to obey its equation of motion [N]. A surface pushes where its force would not
/// pull; it holds while the force stays in the cone, and slips on the cone against the slip otherwise.
void update_contacts(const Environment& environment, double time, double time_step, const data::Points& positions,
                     const data::Points& force, std::vector<VertexConstraint>& constraints);

}  // namespace flash::sim
