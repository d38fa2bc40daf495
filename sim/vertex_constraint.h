#pragma once
#include <Eigen/Core>
#include <vector>

#include "sim/environment.h"

namespace flash::sim {

/// What a vertex may do at the current iterate of a step.
enum class Hold {
  free,
  fixed,  ///< some axes held, by a support or a gripper
  slip,   ///< on a surface, the friction force on the rim of its cone
  stick,  ///< on a surface, at rest against it
};

/// The constraint on one vertex at the current iterate of a step.
struct VertexConstraint {
  Hold hold = Hold::free;
  int grasp = -1;                                        ///< which grasp holds it
  int obstacle = -1;                                     ///< which obstacle is nearest
  double gap = 0.0;                                      ///< to that obstacle [m]
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();      ///< of that obstacle
  Eigen::Vector3d correction = Eigen::Vector3d::Zero();  ///< displacement that a held direction must make [m]
  Eigen::Matrix3d free = Eigen::Matrix3d::Identity();    ///< projector on the directions it may move in
  Eigen::Vector3d reaction = Eigen::Vector3d::Zero();    ///< force on the vertex, always admissible [N]
  Eigen::Vector3d slip_direction =
      Eigen::Vector3d::Zero();  ///< slip / its smoothed length; unit where slip starts
  double friction_bound = 0.0;  ///< mu lambda_n [N]
  double slip_stiffness = 0.0;  ///< mu lambda_n / |slip|, of the friction force across the slip [N/m]
};

/// Held vertices by the environment's supports and grasps at `time`; moves them to where they have to be, and
/// every other vertex out of the obstacles.
std::vector<VertexConstraint> begin_step(const Environment& environment, double time,
                                         data::Points& positions);

/// Decides from the iterate alone what holds each vertex. `force` is what it needs from outside to obey its
/// equation of motion [N]. A vertex on a surface is held while it needs a push. It sticks where it has not
/// slipped in this step and needs a friction force inside the cone; else the force is on the rim, against the
/// slip.
void update_contacts(const Environment& environment, double time, double time_step,
                     const data::Points& positions, const data::Points& force,
                     std::vector<VertexConstraint>& constraints);

/// Makes a trial iterate feasible: vertices out of the obstacles, held ones on their surface, and a slip that
/// turned against its direction stopped at no slip, where it has to decide again.
void project_to_feasible(const Environment& environment, double time, double time_step,
                         const std::vector<VertexConstraint>& constraints, data::Points& positions);

/// sum mu lambda_n |slip| of the held vertices at frozen normal forces: the potential of friction over the
/// step [J].
double friction_potential(const Environment& environment, double time, double time_step,
                          const std::vector<VertexConstraint>& constraints, const data::Points& positions);

}  // namespace flash::sim
