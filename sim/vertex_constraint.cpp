#include "sim/vertex_constraint.h"

#include <algorithm>

#include "sim/contact_geometry.h"

namespace flash::sim {

namespace {

using Eigen::Matrix3d;
using Eigen::RowVector3d;
using Eigen::Vector3d;

constexpr double touching = 1e-9;       ///< gap below which a vertex starts a step in contact [m]
constexpr double resting = 1e-12;       ///< slip below which a vertex has no direction of slip [m]
constexpr int changes_allowed = 12;     ///< of one contact in a step; beyond, it keeps its last hold

Gap nearest_gap(const Environment& environment, const Vector3d& point, double time, int& obstacle) {
  Gap nearest{std::numeric_limits<double>::infinity(), Vector3d::Zero(), Vector3d::Zero()};
  for (size_t k = 0; k < environment.obstacles.size(); ++k) {
    const Gap gap = gap_to(environment.obstacles[k], point, time);
    if (gap.distance < nearest.distance) {
      nearest = gap;
      obstacle = static_cast<int>(k);
    }
  }
  return nearest;
}

void set_hold(VertexConstraint& constraint, Hold hold) {
  if (constraint.hold == hold) return;
  constraint.hold = hold;
  ++constraint.changes;
}

}  // namespace

std::vector<VertexConstraint> begin_step(const Environment& environment, double time, data::Points& positions) {
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
    if (environment.state.grasp_offsets.size() <= k || environment.state.grasp_offsets[k].rows() == 0) continue;
    const Eigen::Isometry3d pose = data::pose_at(grasp.gripper, time);
    const double closed = grasp.closing_time > 0 ? std::clamp((time - grasp.from) / grasp.closing_time, 0.0, 1.0) : 1.0;
    const double blend = closed * closed * (3 - 2 * closed);
    for (size_t v = 0; v < grasp.vertices.size(); ++v) {
      Vector3d offset = environment.state.grasp_offsets[k].row(v);
      if (grasp.targets.rows() > 0) offset += blend * (grasp.targets.row(v).transpose() - offset);
      VertexConstraint& constraint = constraints[grasp.vertices[v]];
      constraint.hold = Hold::fixed;
      constraint.grasp = static_cast<int>(k);
      constraint.free.setZero();
      positions.row(grasp.vertices[v]) = pose * offset;
    }
  }
  for (size_t i = 0; i < constraints.size(); ++i) {
    VertexConstraint& constraint = constraints[i];
    if (constraint.hold == Hold::fixed) continue;
    const Gap gap = nearest_gap(environment, environment.state.positions.row(i), environment.state.time, constraint.obstacle);
    if (gap.distance > touching) continue;
    const Vector3d velocity = environment.state.velocities.row(i).transpose() - gap.surface_velocity;
    const Vector3d sliding = velocity - gap.normal * gap.normal.dot(velocity);
    constraint.hold = sliding.norm() > resting ? Hold::slip : Hold::stick;
  }
  return constraints;
}

void update_contacts(const Environment& environment, double time, double time_step, const data::Points& positions,
                     const data::Points& force, std::vector<VertexConstraint>& constraints) {
  for (size_t i = 0; i < constraints.size(); ++i) {
    VertexConstraint& constraint = constraints[i];
    if (constraint.hold == Hold::fixed) {
      constraint.reaction = force.row(i).transpose() - constraint.free * force.row(i).transpose();
      continue;
    }
    const Gap gap = nearest_gap(environment, positions.row(i), time, constraint.obstacle);
    const Vector3d needed = force.row(i);
    const double needed_normal = gap.normal.dot(needed);
    constraint.gap = gap.distance;
    constraint.normal = gap.normal;
    const bool settled = constraint.changes >= changes_allowed;
    const bool held = constraint.hold != Hold::free;
    if (!held && gap.distance < 0 && !settled) set_hold(constraint, Hold::stick);
    if (held && needed_normal < 0 && gap.distance > -touching && !settled) set_hold(constraint, Hold::free);
    constraint.correction.setZero();
    constraint.reaction.setZero();
    constraint.stiffness.setZero();
    constraint.friction_bound = 0;
    constraint.free.setIdentity();
    if (constraint.hold == Hold::free) continue;

    const Matrix3d tangent = Matrix3d::Identity() - gap.normal * gap.normal.transpose();
    const Obstacle& obstacle = environment.obstacles[constraint.obstacle];
    const double friction = obstacle.friction >= 0 ? obstacle.friction : environment.material.friction;
    const double normal_force = std::max(needed_normal, 0.0), bound = friction * normal_force;
    const Vector3d needed_tangential = tangent * needed;
    const Vector3d slip =
        tangent * (positions.row(i) - environment.state.positions.row(i)).transpose() - time_step * (tangent * gap.surface_velocity);
    const double slip_length = slip.norm();

    if (!settled && constraint.hold == Hold::stick && needed_tangential.norm() > bound) {
      set_hold(constraint, Hold::slip);
      constraint.slip_direction = -needed_tangential.normalized();
    } else if (!settled && constraint.hold == Hold::slip) {
      const bool reversed = slip.dot(constraint.slip_direction) < 0;
      if (slip_length < resting || reversed) set_hold(constraint, Hold::stick);
    }

    constraint.correction = -gap.distance * gap.normal;
    constraint.reaction = normal_force * gap.normal;
    if (constraint.hold == Hold::stick) {
      constraint.free.setZero();
      constraint.correction -= slip;
      const double excess = needed_tangential.norm();
      constraint.reaction += excess > bound ? Vector3d(needed_tangential * (bound / excess)) : needed_tangential;
    } else {
      if (slip_length > resting) constraint.slip_direction = slip / slip_length;
      const Vector3d& direction = constraint.slip_direction;
      constraint.free = tangent;
      constraint.friction_bound = bound;
      constraint.reaction -= bound * direction;
      if (slip_length > resting) constraint.stiffness = bound / slip_length * (tangent - direction * direction.transpose());
    }
  }
}

}  // namespace flash::sim
