#pragma once
#include <Eigen/Core>
#include <array>
#include <memory>
#include <span>
#include <vector>

#include "sim/law/mesh_gap.h"
#include "sim/law/vertex_contact.h"
#include "sim/scene/environment.h"
#include "sim/scene/sheet.h"
#include "sim/step/moving_obstacles.h"

namespace flash::sim {

/// The step in which vertices meet obstacles: from environment.state to `time`, `time_step` later.
struct ContactStep {
  /// Sheet and environment have to outlive the step.
  ContactStep(const Sheet& sheet, const Environment& environment, double time_step,
              const WayOut<double>& way_out);

  const Sheet& sheet;
  const Environment& environment;
  double time, time_step;                         ///< [s]
  WayOut<double> way_out;                         ///< how vertices that start inside an obstacle leave it
  std::vector<MovingObstacle<double>> obstacles;  ///< of a mesh one for each surface that a vertex may touch
  std::vector<int> owners;  ///< of each of them: the obstacle of the environment that it is part of
  bool several;  ///< whether a box stands beside another obstacle, so that one may continue the other

  ObstacleStep<double> view() const;

  /// The obstacles with their friction on vertex i.
  ObstacleStep<double> view_of(int i) const;

  /// Where vertex i is at the start of the step.
  Vector3<double> start(int i) const { return vector3(environment.state.positions, i); }

  /// The bristles of an obstacle on vertex i at the start of the step, as in State. The surfaces of a mesh
  /// have theirs in common.
  Vector3<double> bristle(int obstacle, int i) const {
    const State& state = environment.state;
    return state.bristles.rows() == 0
               ? Vector3<double>{}
               : vector3(state.bristles, owners[obstacle] * static_cast<int>(state.positions.rows()) + i);
  }

  /// How vertex i stands against an obstacle, were it at row i of `positions` at the end of the step.
  SurfaceGap<double> gap(int obstacle, const data::Points& positions, int i) const;

  /// Signed distance of vertex i to an obstacle at the start of the step [m].
  double distance_at_start(int obstacle, int i) const;

 private:
  /// The obstacles with their friction on each body after the first.
  std::vector<std::vector<MovingObstacle<double>>> others_;
  std::vector<std::unique_ptr<MeshMemory>> memories_;  ///< one a mesh
};

/// A vertex that obstacles or holds keep from moving freely.
struct VertexConstraint : VertexContact {
  int vertex = -1;
  std::array<int, 3> holds = {-1, -1, -1};  ///< number of the hold that it obeys in each axis, -1 for none
};

/// Working room for the vertices of a step with any number of obstacles.
struct ContactRoom {
  std::vector<Vector3<double>> normals, directions;
  std::vector<double> right, solution;
  std::vector<int> those;

  explicit ContactRoom(std::size_t obstacles)
      : normals(obstacles), directions(obstacles), right(obstacles), solution(obstacles), those(obstacles) {}
};

/// The vertices that something holds. Those that nothing holds are not in the list: only their clearance is
/// known.
struct ContactSet {
  std::vector<VertexConstraint> constraints;
  std::size_t held = 0;              ///< the first `held` constraints are vertices that holds carry
  std::size_t obstacles = 0;         ///< of the step: number of touches of each other constraint
  std::vector<VertexTouch> touches;  ///< touches of each constraint with every obstacle
  std::vector<int> place;            ///< index of each vertex in `constraints`; -1: nothing holds it
  std::vector<double> clearance;     ///< distance of each vertex to the nearest obstacle [m]

  const VertexConstraint* find(int vertex) const {
    return place[vertex] < 0 ? nullptr : &constraints[place[vertex]];
  }
  /// Touches of constraint k with every obstacle; none for held vertices.
  std::span<VertexTouch> touches_of(std::size_t k) {
    return k < held ? std::span<VertexTouch>()
                    : std::span(touches).subspan((k - held) * obstacles, obstacles);
  }
  std::span<const VertexTouch> touches_of(std::size_t k) const {
    return k < held ? std::span<const VertexTouch>()
                    : std::span(touches).subspan((k - held) * obstacles, obstacles);
  }
};

/// The vertices that the environment's holds carry rigidly; moves them to where they have to be at the end of
/// the step.
ContactSet begin_step(const ContactStep& step, data::Points& positions);

/// Adds what holds exert on a vertex under `reaction` [N] to the forces of the holds that it obeys.
void add_hold_forces(const VertexConstraint& constraint, const Vector3<double>& reaction,
                     std::vector<Eigen::Vector3d>& forces);

/// Sets `clearance` to the smallest gap of each vertex, no_such_side without obstacles [m].
void find_clearance(const ContactStep& step, const data::Points& positions, std::vector<double>& clearance);

/// Appends the touches of vertex i with every obstacle. Returns the first of them.
VertexTouch* add_touches(const ContactStep& step, const data::Points& positions, int i, ContactSet& contacts);

/// Decides from the iterate alone what holds each vertex, as decide_contact says. `force` is what it needs
/// from outside to obey its equation of motion [N].
void update_contacts(const ContactStep& step, const data::Points& positions, const data::Points& force,
                     ContactSet& contacts);

/// The matrix of friction_coupling of each constraint.
std::vector<Eigen::Matrix3d> friction_couplings(const ContactStep& step, const ContactSet& contacts);

/// sum mu lambda_n |slip| of the held vertices at frozen normal forces: the potential of friction over the
/// step [J].
double friction_potential(const ContactStep& step, const ContactSet& contacts, const data::Points& positions);

/// The bristles at the end of the step at `positions`, as in State; zero where nothing holds a vertex.
data::Points bristles_at_end(const ContactStep& step, const ContactSet& contacts,
                             const data::Points& positions);

}  // namespace flash::sim
