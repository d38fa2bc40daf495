#pragma once
#include <Eigen/Core>
#include <array>
#include <span>
#include <vector>

#include "sim/scene/environment.h"
#include "sim/scene/sheet.h"
#include "sim/step/moving_obstacles.h"
#include "sim/step/touch.h"

namespace flash::sim {

/// The step in which vertices meet obstacles: from environment.state to `time`, `time_step` later.
struct ContactStep {
  /// Sheet and environment have to outlive the step.
  ContactStep(const Sheet& sheet, const Environment& environment, double time_step,
              const WayOut<double>& way_out);

  const Sheet& sheet;
  const Environment& environment;
  double time, time_step;  ///< [s]
  WayOut<double> way_out;  ///< how vertices that start inside an obstacle leave it
  std::vector<MovingObstacle<double>> obstacles;
  bool several;  ///< whether a box stands beside another obstacle, so that one may continue the other

  ObstacleStep<double> view() const;

  /// How vertex i stands against an obstacle, were it at row i of `positions` at the end of the step.
  SurfaceGap<double> gap(int obstacle, const data::Points& positions, int i) const;

  /// Whether vertex i, were it at row i of `positions`, is too far from a box to meet it.
  bool is_far(int obstacle, const data::Points& positions, int i) const;

  /// Signed distance of vertex i to an obstacle at the start of the step [m].
  double distance_at_start(int obstacle, int i) const;
};

/// What holds a vertex at the current iterate of a step.
struct VertexConstraint {
  int vertex = -1;
  Freedom freedom = Freedom::free;
  std::array<int, 3> holds = {-1, -1, -1};  ///< number of the hold that it obeys in each axis, -1 for none
  Eigen::Vector3d correction = Eigen::Vector3d::Zero();  ///< displacement that a held direction must make [m]
  Eigen::Matrix3d free = Eigen::Matrix3d::Identity();    ///< projector on the directions it may move in
  Eigen::Vector3d reaction = Eigen::Vector3d::Zero();    ///< force on the vertex, always admissible [N]
  Eigen::Vector3d slip_direction = Eigen::Vector3d::Zero();  ///< free part of the slip, divided by its length
  double friction_bound = 0.0;                               ///< sum of mu lambda_n [N]
  /// How the friction force turns with the slip: the sum of mu lambda_n / |slip| across it [N/m].
  Eigen::Matrix3d slip_stiffness = Eigen::Matrix3d::Zero();
};

/// The vertices that something holds. Those that nothing holds are not in the list: only their clearance is
/// known.
struct ContactSet {
  std::vector<VertexConstraint> constraints;
  std::size_t held = 0;           ///< the first `held` constraints are vertices that holds carry
  std::size_t obstacles = 0;      ///< number of touches of each other constraint
  std::vector<Touch> touches;     ///< touches of each constraint with every obstacle
  std::vector<int> place;         ///< index of each vertex in `constraints`; -1: nothing holds it
  std::vector<double> clearance;  ///< distance of each vertex to the nearest obstacle [m]

  const VertexConstraint* find(int vertex) const {
    return place[vertex] < 0 ? nullptr : &constraints[place[vertex]];
  }
  /// Touches of constraint k with every obstacle; none for held vertices.
  std::span<Touch> touches_of(std::size_t k) {
    return k < held ? std::span<Touch>() : std::span(touches).subspan((k - held) * obstacles, obstacles);
  }
  std::span<const Touch> touches_of(std::size_t k) const {
    return k < held ? std::span<const Touch>()
                    : std::span(touches).subspan((k - held) * obstacles, obstacles);
  }
};

/// The vertices that the environment's holds carry; moves them to where they have to be at the end of the
/// step.
ContactSet begin_step(const ContactStep& step, data::Points& positions);

/// Adds what holds exert on a vertex under `reaction` [N] to the forces of the holds that it obeys.
void add_hold_forces(const VertexConstraint& constraint, const Eigen::Vector3d& reaction,
                     std::vector<Eigen::Vector3d>& forces);

/// Sets `clearance` to the smallest gap of each vertex, infinity without obstacles [m].
void find_clearance(const ContactStep& step, const data::Points& positions, std::vector<double>& clearance);

/// Appends to `touches` vertex i against every obstacle.
void add_touches(const ContactStep& step, const data::Points& positions, int i, std::vector<Touch>& touches);

/// Decides from the iterate alone what holds each vertex. `force` is what it needs from outside to obey its
/// equation of motion [N]. A vertex on a surface is held while it needs a push. It sticks where it has not
/// slipped in this step and needs a friction force inside the cone. Else the force is on the rim, against the
/// slip. Of several surfaces each rubs against its own slip, which enters the normal forces of the others.
/// Between two the vertex moves along their edge alone, between three not at all.
void update_contacts(const ContactStep& step, const data::Points& positions, const data::Points& force,
                     ContactSet& contacts);

/// How the friction forces of slipping vertices change with the force on them, a matrix for each constraint:
/// the sum of mu_k d_k l_k^T. Here d_k is the direction of slip and l_k . f the normal force of surface k
/// under the force f. The matrix is zero for all others.
std::vector<Eigen::Matrix3d> friction_couplings(const ContactSet& contacts);

/// sum mu lambda_n |slip| of the held vertices at frozen normal forces: the potential of friction over the
/// step [J].
double friction_potential(const ContactStep& step, const ContactSet& contacts, const data::Points& positions);

/// Displacement of a held vertex since the start of the step along and against the surfaces that hold it [m].
/// Where there are several, it is against their mean, weighted by mu lambda_n.
Eigen::Vector3d slip_of(const ContactStep& step, const data::Points& positions, int vertex,
                        std::span<const Touch> touches);

}  // namespace flash::sim
