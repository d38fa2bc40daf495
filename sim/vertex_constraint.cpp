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

/// The two obstacles nearest to a point.
std::array<Touch, 2> nearest_touches(const Environment& environment, const Vector3d& point, double time,
                                     double time_step) {
  std::array<Touch, 2> touches;
  for (size_t k = 0; k < environment.obstacles.size(); ++k) {
    const Gap gap = gap_to(environment.obstacles[k], point, time, time_step);
    const Touch touch{static_cast<int>(k), false, gap.distance, 0, gap.normal, gap.curved};
    if (touches[0].obstacle < 0 || touch.gap < touches[0].gap) {
      touches[1] = touches[0];
      touches[0] = touch;
    } else if (touches[1].obstacle < 0 || touch.gap < touches[1].gap) {
      touches[1] = touch;
    }
  }
  return touches;
}

double friction_of(const Environment& environment, const Touch& touch) {
  const Obstacle& obstacle = environment.obstacles[touch.obstacle];
  return obstacle.friction >= 0 ? obstacle.friction : environment.material.friction;
}

/// Displacement since the start of the step along the surfaces that hold the vertex, against them: against
/// their mean by mu lambda_n where there are two [m].
Vector3d slip_of(const Environment& environment, const VertexConstraint& constraint, double time,
                 double time_step, const data::Points& positions, int i) {
  const auto gap_of = [&](const Touch& touch) {
    return gap_to(environment.obstacles[touch.obstacle], positions.row(i), time, time_step);
  };
  const Vector3d moved = (positions.row(i) - environment.state.positions.row(i)).transpose();
  const auto& [first, second] = constraint.touches;
  if (!(first.holds && second.holds)) {
    const Gap gap = gap_of(first.holds ? first : second);
    const Vector3d against = moved - gap.surface_moved;
    return against - gap.normal * gap.normal.dot(against);
  }
  const Gap first_gap = gap_of(first), second_gap = gap_of(second);
  const double first_weight = friction_of(environment, first) * first.normal_force + 1e-300,
               second_weight = friction_of(environment, second) * second.normal_force + 1e-300;
  const Vector3d surfaces_moved =
      (first_weight * first_gap.surface_moved + second_weight * second_gap.surface_moved) /
      (first_weight + second_weight);
  const Vector3d edge = first_gap.normal.cross(second_gap.normal).normalized();
  return edge * edge.dot(moved - surfaces_moved);
}

/// Length of a slip as friction takes it, smooth where it starts [m].
double smooth_length(double length) { return std::sqrt(length * length + smoothing * smoothing); }

}  // namespace

Matrix3d along_surfaces(const std::array<Touch, 2>& touches) {
  const auto& [first, second] = touches;
  if (first.holds && second.holds) {
    const Vector3d edge = first.normal.cross(second.normal).normalized();
    return edge * edge.transpose();
  }
  const Vector3d& normal = first.holds ? first.normal : second.normal;
  return Matrix3d::Identity() - normal * normal.transpose();
}

std::array<double, 2> normal_forces(const std::array<Touch, 2>& touches, const std::array<bool, 2>& eligible,
                                    const Vector3d& needed) {
  const double first = eligible[0] ? touches[0].normal.dot(needed) : 0.0;
  const double second = eligible[1] ? touches[1].normal.dot(needed) : 0.0;
  if (eligible[0] && eligible[1]) {
    const double cosine = touches[0].normal.dot(touches[1].normal), regular = 1 - cosine * cosine;
    // Faces that point the same way, or against each other, have no edge: one of them holds.
    if (regular > 1e-6) {
      const double both_first = (first - cosine * second) / regular,
                   both_second = (second - cosine * first) / regular;
      if (both_first > 0 && both_second > 0) return {both_first, both_second};
      if (first > 0 && both_second <= 0) return {first, 0.0};
      return {0.0, both_first <= 0 ? std::max(second, 0.0) : 0.0};
    }
  }
  if (first > 0) return {first, 0.0};
  return {0.0, std::max(second, 0.0)};
}

Vector3d force_from(const Environment& environment, const VertexConstraint& constraint, const Touch& touch) {
  if (!touch.holds) return Vector3d::Zero();
  Vector3d friction = constraint.reaction;
  for (const Touch& each : constraint.touches) friction -= each.normal_force * each.normal;
  const double share = constraint.friction_bound > 0
                           ? friction_of(environment, touch) * touch.normal_force / constraint.friction_bound
                           : 0.0;
  return touch.normal_force * touch.normal + share * friction;
}

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
        constraint.touches = nearest_touches(environment, positions.row(i), time, time_step);
      continue;
    }
    // Of a free one all but the touches is as it was made: most of them are, and it is much to write.
    if (constraint.hold != Hold::free) constraint = VertexConstraint{};
    auto& touches = constraint.touches;
    touches = nearest_touches(environment, positions.row(i), time, time_step);
    const auto on_surface = [&](const Touch& touch) { return touch.obstacle >= 0 && touch.gap <= touching; };
    if (!on_surface(touches[0])) continue;
    const std::array<double, 2> normal = normal_forces(touches, {true, on_surface(touches[1])}, needed);
    for (int k = 0; k < 2; ++k) {
      touches[k].holds = normal[k] > 0;
      touches[k].normal_force = normal[k];
      if (touches[k].holds) constraint.friction_bound += friction_of(environment, touches[k]) * normal[k];
    }
    if (!touches[0].holds && !touches[1].holds) continue;

    const double bound = constraint.friction_bound;
    const Matrix3d along = along_surfaces(touches);
    const Vector3d needed_tangential = along * needed;
    const Vector3d slip = slip_of(environment, constraint, time, time_step, positions, static_cast<int>(i));
    const double slip_length = slip.norm(), needed_length = needed_tangential.norm();
    if (slip_length <= resting && needed_length <= bound) {
      constraint.hold = Hold::stick;
      constraint.free.setZero();
      constraint.reaction = needed;
      continue;
    }
    constraint.hold = Hold::slip;
    constraint.free = along;
    if (slip_length > resting) {
      const double length = smooth_length(slip_length);
      constraint.slip_direction = slip / length;
      constraint.slip_stiffness = bound / length;
    } else {
      constraint.slip_direction = -needed_tangential / needed_length;
    }
    constraint.reaction = -bound * constraint.slip_direction;
    for (const Touch& touch : touches) constraint.reaction += touch.normal_force * touch.normal;
  }
}

void project_to_feasible(const Environment& environment, double time, double time_step,
                         const std::vector<VertexConstraint>& constraints, data::Points& positions) {
  if (environment.obstacles.empty()) return;
  // Exact for one obstacle; onto two at once by turns.
  const int sweeps = environment.obstacles.size() > 1 ? 40 : 1;
  for (size_t i = 0; i < constraints.size(); ++i) {
    const VertexConstraint& constraint = constraints[i];
    if (constraint.hold == Hold::fixed) continue;
    const auto touch_of = [&](size_t obstacle) {
      return std::find_if(constraint.touches.begin(), constraint.touches.end(), [&](const Touch& touch) {
        return touch.holds && touch.obstacle == static_cast<int>(obstacle);
      });
    };
    for (int sweep = 0; sweep < sweeps; ++sweep) {
      double moved = 0;
      for (size_t k = 0; k < environment.obstacles.size(); ++k) {
        const Gap gap = gap_to(environment.obstacles[k], positions.row(i), time, time_step);
        const auto touch = touch_of(k);
        // A vertex that is to land does so where the step is long enough to bring it down.
        const bool lands = touch != constraint.touches.end() &&
                           (touch->gap <= touching || gap.distance <= 0.01 * touch->gap);
        if (!(gap.distance < 0 || lands)) continue;
        positions.row(i) -= gap.distance * gap.normal.transpose();
        moved = std::max(moved, std::abs(gap.distance));
      }
      if (moved <= resting) break;
    }
    if (constraint.hold == Hold::slip) {
      const Vector3d slip = slip_of(environment, constraint, time, time_step, positions, static_cast<int>(i));
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
    const Vector3d slip = slip_of(environment, constraint, time, time_step, positions, static_cast<int>(i));
    potential += constraint.friction_bound *
                 (constraint.slip_stiffness > 0 ? smooth_length(slip.norm()) : slip.norm());
  }
  return potential;
}

}  // namespace flash::sim
