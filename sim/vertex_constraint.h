#pragma once
#include <Eigen/Core>
#include <vector>

#include "sim/contact_geometry.h"
#include "sim/environment.h"

namespace flash::sim {

/// Gap up to which a vertex is on a surface: rounding of a projected position [m].
inline constexpr double touching_gap = 1e-10;

/// What a vertex may do at the current iterate of a step.
enum class Hold {
  free,
  fixed,  ///< some axes held, by a support or a gripper
  slip,   ///< on a surface, the friction force on the rim of its cone
  stick,  ///< on a surface, at rest against it
};

/// A vertex against an obstacle.
struct Touch {
  int obstacle = -1;
  bool holds = false;       ///< the vertex stays on it
  bool let_go = false;      ///< in the linear problem of this iterate, which would have had to pull
  double gap = 0.0;         ///< [m]
  double sunk = 0.0;        ///< as in Gap [m]
  double normal_force = 0;  ///< lambda_n of an obstacle that holds [N]
  double slip = 0.0;        ///< length of the slip against it in this step, as friction takes it [m]
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  Eigen::Vector3d curved = Eigen::Vector3d::Zero();          ///< as in Gap
  Eigen::Vector3d slip_direction = Eigen::Vector3d::Zero();  ///< of its own slip, over `slip`
  Eigen::Vector3d friction = Eigen::Vector3d::Zero();        ///< its friction force on the vertex [N]
};

/// The constraint on one vertex at the current iterate of a step.
struct VertexConstraint {
  Hold hold = Hold::free;
  int grasp = -1;                                        ///< which grasp holds it
  std::vector<Touch> touches;                            ///< one an obstacle
  Eigen::Vector3d correction = Eigen::Vector3d::Zero();  ///< displacement that a held direction must make [m]
  Eigen::Matrix3d free = Eigen::Matrix3d::Identity();    ///< projector on the directions it may move in
  Eigen::Vector3d reaction = Eigen::Vector3d::Zero();    ///< force on the vertex, always admissible [N]
  Eigen::Vector3d slip_direction =
      Eigen::Vector3d::Zero();  ///< of the slip that is free to go on, over its length
  /// How the friction force changes with the force on the vertex, by its normal forces.
  Eigen::Matrix3d friction_coupling = Eigen::Matrix3d::Zero();
  double friction_bound = 0.0;  ///< sum of mu lambda_n [N]
  /// How the friction force turns with the slip: the sum of mu lambda_n / |slip| across it [N/m].
  Eigen::Matrix3d slip_stiffness = Eigen::Matrix3d::Zero();
};

/// The step in which vertices meet obstacles: from environment.state to `time`, `time_step` later.
struct ContactStep {
  ContactStep(const Environment& environment, double time_step, double exit_speed);

  const Environment& environment;
  double time, time_step;  ///< [s]
  double exit_speed;       ///< of vertices that start inside an obstacle, at most [m/s]
  std::vector<ObstacleMotion> motions;

  /// How vertex i stands against an obstacle, were it at row i of `positions` at the end of the step.
  Gap gap(int obstacle, const data::Points& positions, int i) const {
    return gap_after(environment.obstacles[obstacle], motions[obstacle],
                     environment.state.positions.row(i).transpose(), positions.row(i).transpose(), time_step,
                     exit_speed);
  }
};

/// Projector on the directions along all surfaces that hold the vertex: a plane, the edge of two, or nothing.
Eigen::Matrix3d along_surfaces(const std::vector<Touch>& touches);

/// The x >= 0 with y = N^T C x - b >= 0 and x . y = 0 (a linear complementarity problem), N the unit
/// `normals` as columns and C the `directions`: of at most three of them that are independent. Where there is
/// none (faces that press against each other), what comes nearest. As forces, with b = N^T f and C = N: the
/// non-negative ones that come nearest to f. As a displacement N x, with b minus the gaps: the shortest that
/// closes all of them.
std::vector<double> complementary(const std::vector<Eigen::Vector3d>& normals,
                                  const std::vector<Eigen::Vector3d>& directions,
                                  const std::vector<double>& b);

/// Normal forces of the touches without friction between them: the non-negative ones of least squares for
/// `needed` [N]. A touch whose `eligible` is false takes none.
std::vector<double> normal_forces(const std::vector<Touch>& touches, const std::vector<bool>& eligible,
                                  const Eigen::Vector3d& needed);

/// Held vertices by the environment's supports and grasps at the end of the step; moves them to where they
/// have to be, and every other vertex out of the obstacles.
std::vector<VertexConstraint> begin_step(const ContactStep& step, data::Points& positions);

/// Decides from the iterate alone what holds each vertex. `force` is what it needs from outside to obey its
/// equation of motion [N]. A vertex on a surface is held while it needs a push. It sticks where it has not
/// slipped in this step and needs a friction force inside the cone; else the force is on the rim, against the
/// slip. Of several surfaces each rubs against its own slip, which enters the normal forces of the others;
/// the vertex moves along the edge of two alone, and between three not at all.
void update_contacts(const ContactStep& step, const data::Points& positions, const data::Points& force,
                     std::vector<VertexConstraint>& constraints);

/// Makes a trial iterate feasible: vertices out of the obstacles, held ones on their surface, and a slip that
/// turned against its direction stopped at no slip, where it has to decide again.
void project_to_feasible(const ContactStep& step, const std::vector<VertexConstraint>& constraints,
                         data::Points& positions);

/// sum mu lambda_n |slip| of the held vertices at frozen normal forces: the potential of friction over the
/// step [J].
double friction_potential(const ContactStep& step, const std::vector<VertexConstraint>& constraints,
                          const data::Points& positions);

/// The deepest of the vertices that supports or grippers hold below an obstacle's surface at the end of the
/// step, or took through it in the step: below the face through which the way came in.
Penetration deepest_held(const ContactStep& step, const std::vector<VertexConstraint>& constraints,
                         const data::Points& positions);

}  // namespace flash::sim
