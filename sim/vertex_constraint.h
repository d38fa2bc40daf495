#pragma once
#include <Eigen/Core>
#include <array>
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

/// A vertex against an obstacle that is near.
struct Touch {
  int obstacle = -1;        ///< none: -1
  bool holds = false;       ///< the vertex stays on it
  double gap = 0.0;         ///< [m]
  double normal_force = 0;  ///< lambda_n of an obstacle that holds [N]
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  Eigen::Vector3d curved = Eigen::Vector3d::Zero();  ///< as in Gap
};

/// The constraint on one vertex at the current iterate of a step. Two obstacles at most touch a vertex at
/// once.
struct VertexConstraint {
  Hold hold = Hold::free;
  int grasp = -1;                                        ///< which grasp holds it
  std::array<Touch, 2> touches;                          ///< the nearest obstacles, the nearest first
  Eigen::Vector3d correction = Eigen::Vector3d::Zero();  ///< displacement that a held direction must make [m]
  Eigen::Matrix3d free = Eigen::Matrix3d::Identity();    ///< projector on the directions it may move in
  Eigen::Vector3d reaction = Eigen::Vector3d::Zero();    ///< force on the vertex, always admissible [N]
  Eigen::Vector3d slip_direction =
      Eigen::Vector3d::Zero();  ///< slip / its smoothed length; unit where slip starts
  double friction_bound = 0.0;  ///< sum of mu lambda_n [N]
  double slip_stiffness = 0.0;  ///< friction_bound / |slip|, of the friction force across the slip [N/m]
};

/// Projector on the directions along all surfaces that hold the vertex: a plane, or the edge between two.
Eigen::Matrix3d along_surfaces(const std::array<Touch, 2>& touches);

/// Normal forces of the two touches without friction between them: the solution of least squares for `needed`
/// [N] with both not negative. A touch with `eligible` false takes none.
std::array<double, 2> normal_forces(const std::array<Touch, 2>& touches, const std::array<bool, 2>& eligible,
                                    const Eigen::Vector3d& needed);

/// The part of the reaction that an obstacle contributes; friction is shared in proportion to mu lambda_n
/// [N].
Eigen::Vector3d force_from(const Environment& environment, const VertexConstraint& constraint,
                           const Touch& touch);

/// Held vertices by the environment's supports and grasps at `time`; moves them to where they have to be, and
/// every other vertex out of the obstacles.
std::vector<VertexConstraint> begin_step(const Environment& environment, double time,
                                         data::Points& positions);

/// Decides from the iterate alone what holds each vertex. `force` is what it needs from outside to obey its
/// equation of motion [N]. A vertex on a surface is held while it needs a push. It sticks where it has not
/// slipped in this step and needs a friction force inside the cone; else the force is on the rim, against the
/// slip. Between two surfaces it moves along their edge alone, where both rub.
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
