#include "sim/vertex_constraint.h"

#include <algorithm>
#include <cmath>

#include "sim/contact_geometry.h"

namespace flash::sim {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double touching =
    1e-10;  ///< gap up to which a vertex is on a surface: rounding of a projected position [m]
constexpr double resting = 1e-13;  ///< slip up to which a vertex has not moved: rounding of a position [m]
constexpr double smoothing =
    1e-8;  ///< slip at which friction is 0.7 of its bound, for a smooth start of sliding [m]

Gap nearest_gap(const Environment& environment, const Vector3d& point, double time, double time_step,
                int& obstacle) {
  Gap nearest{std::numeric_limits<double>::infinity(), Vector3d::Zero(), Vector3d::Zero()};
  for (size_t k = 0; k < environment.obstacles.size(); ++k) {
    const Gap gap = gap_to(environment.obstacles[k], point, time, time_step);
    if (gap.distance < nearest.distance) {
      nearest = gap;
      obstacle = static_cast<int>(k);
    }
  }
  return nearest;
}

/// Tangential displacement since the start of the step against the surface [m].
Vector3d slip_of(const Environment& environment, const Gap& gap, const data::Points& positions, int i) {
  const Vector3d moved =
      (positions.row(i) - environment.state.positions.row(i)).transpose() - gap.surface_moved;
  return moved - gap.normal * gap.normal.dot(moved);
}

}  // namespace

std::vector<VertexConstraint> begin_step(const Environment& environment, double time,
                                         data::Points& positions) {
  std::vector<VertexConstraint> constraints(environment.state.positions.rows());
  for (const FixedVertex& support : environment.fixed) {
    VertexConstraint& constraint = constraints[support.vertex];
    constraint.hold = Hold::fixed;
    for (int axis = 0; axis < 3; ++axis) {
      if (!support.axes[axis]) continue;
      constraint.free(axis, axis) = 0;
      positions(support.vertex, axis) = support.position[axis];
    }
  }
  for (size_t k = 0; k < environment.grasps.size(); ++k) {
    const Grasp& grasp = environment.grasps[k];
    const data::Points& offsets = environment.state.grasp_offsets[k];
    if (offsets.rows() == 0) continue;
    const Eigen::Isometry3d pose = data::pose_at(grasp.gripper, time);
    const double closed =
        grasp.closing_time > 0 ? std::clamp((time - grasp.from) / grasp.closing_time, 0.0, 1.0) : 1.0;
    const double blend = closed * closed * (3 - 2 * closed);
    for (size_t v = 0; v < grasp.vertices.size(); ++v) {
      Vector3d offset = offsets.row(v);
      if (grasp.targets.rows() > 0) offset += blend * (grasp.targets.row(v).transpose() - offset);
      VertexConstraint& constraint = constraints[grasp.vertices[v]];
      constraint.hold = Hold::fixed;
      constraint.grasp = static_cast<int>(k);
      constraint.free.setZero();
      positions.row(grasp.vertices[v]) = pose * offset;
    }
  }
  project_to_feasible(environment, time, 0, constraints, positions);
  return constraints;
}

void update_contacts(const Environment& environment, double time, double time_step,
                     const data::Points& positions, const data::Points& force,
                     std::vector<VertexConstraint>& constraints) {
  for (size_t i = 0; i < constraints.size(); ++i) {
    VertexConstraint& constraint = constraints[i];
    const Vector3d needed = force.row(i);
    if (constraint.hold == Hold::fixed) {
      constraint.reaction = needed - constraint.free * needed;
      // Not kept out of the obstacles, but seen there.
      if (!constraint.free.isZero())
        constraint.gap =
            nearest_gap(environment, positions.row(i), time, time_step, constraint.obstacle).distance;
      continue;
    }
    constraint = VertexConstraint{};
    const Gap gap = nearest_gap(environment, positions.row(i), time, time_step, constraint.obstacle);
    const double normal_force = gap.normal.dot(needed);
    constraint.gap = gap.distance;
    constraint.normal = gap.normal;
    if (gap.distance > touching || normal_force <= 0) continue;

    const Obstacle& obstacle = environment.obstacles[constraint.obstacle];
    const double friction = obstacle.friction >= 0 ? obstacle.friction : environment.material.friction;
    const double bound = friction * normal_force;
    const Vector3d needed_tangential = needed - normal_force * gap.normal;
    const Vector3d slip = slip_of(environment, gap, positions, static_cast<int>(i));
    const double slip_length = slip.norm(), needed_length = needed_tangential.norm();
    constraint.friction_bound = bound;
    constraint.reaction = normal_force * gap.normal;
    if (slip_length <= resting && needed_length <= bound) {
      constraint.hold = Hold::stick;
      constraint.free.setZero();
      constraint.reaction += needed_tangential;
      continue;
    }
    constraint.hold = Hold::slip;
    constraint.free = Matrix3d::Identity() - gap.normal * gap.normal.transpose();
    if (slip_length > resting) {
      const double smooth_length = std::hypot(slip_length, smoothing);
      constraint.slip_direction = slip / smooth_length;
      constraint.slip_stiffness = bound / smooth_length;
    } else {
      constraint.slip_direction = -needed_tangential / needed_length;
    }
    constraint.reaction -= bound * constraint.slip_direction;
  }
}

void project_to_feasible(const Environment& environment, double time, double time_step,
                         const std::vector<VertexConstraint>& constraints, data::Points& positions) {
  if (environment.obstacles.empty()) return;
  for (size_t i = 0; i < constraints.size(); ++i) {
    const VertexConstraint& constraint = constraints[i];
    if (constraint.hold == Hold::fixed) continue;
    int obstacle = -1;
    const Gap gap = nearest_gap(environment, positions.row(i), time, time_step, obstacle);
    const bool held = constraint.hold != Hold::free && obstacle == constraint.obstacle;
    // A vertex that is to land does so where the step is long enough to bring it down.
    const bool lands = held && (constraint.correction.isZero(0) || gap.distance <= 0.01 * constraint.gap);
    if (gap.distance < 0 || lands) positions.row(i) -= gap.distance * gap.normal.transpose();
    if (held && constraint.hold == Hold::slip) {
      const Vector3d slip = slip_of(environment, gap, positions, static_cast<int>(i));
      if (slip.dot(constraint.slip_direction) < 0) positions.row(i) -= slip.transpose();
    }
  }
}

double friction_potential(const Environment& environment, double time, double time_step,
                          const std::vector<VertexConstraint>& constraints, const data::Points& positions) {
  double potential = 0;
  for (size_t i = 0; i < constraints.size(); ++i) {
    const VertexConstraint& constraint = constraints[i];
    if (constraint.friction_bound == 0) continue;
    const Gap gap = gap_to(environment.obstacles[constraint.obstacle], positions.row(i), time, time_step);
    const Vector3d slip = slip_of(environment, gap, positions, static_cast<int>(i));
    potential += constraint.friction_bound *
                 (constraint.slip_stiffness > 0 ? std::hypot(slip.norm(), smoothing) : slip.norm());
  }
  return potential;
}

}  // namespace flash::sim
