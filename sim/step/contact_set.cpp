#include "sim/step/contact_set.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace flash::sim {

using data::Points;
using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {

double friction_bound_of(const Touch& touch) { return touch.friction_coefficient * touch.normal_force; }

/// Length of a slip as friction takes it, smooth where it starts [m].
double smooth_length(double length) { return std::sqrt(length * length + slip_smoothing * slip_smoothing); }

Vector3d way_of(const ContactStep& step, const Points& positions, int i) {
  return (positions.row(i) - step.environment.state.positions.row(i)).transpose();
}

/// Fills in the slip of a vertex that moved by `way` against each touching surface. Returns the longest [m].
double find_slips(const Vector3d& way, std::span<Touch> touches) {
  double longest = 0;
  for (Touch& touch : touches) {
    if (!touch.touches()) continue;
    const Vector3d moved = way - touch.surface_moved;
    const Vector3d slip = moved - touch.normal * touch.normal.dot(moved);
    const double length = slip.norm();
    longest = std::max(longest, length);
    touch.slip = smooth_length(length);
    touch.slip_direction = slip / touch.slip;
  }
  return longest;
}

/// Normal forces of the touches of a vertex that needs `needed` [N]. Each of several that it slips on rubs.
void find_normal_forces(const Vector3d& needed, bool slipped, std::span<Touch> touches) {
  const auto eligible = [](const Touch& touch) { return touch.touches(); };
  if (!slipped || std::count_if(touches.begin(), touches.end(), eligible) < 2)
    return share_force(touches, needed, eligible);
  share_force_rubbing(touches, needed, eligible);
}

/// The constraint of a vertex that touches surfaces; it is free where none of them has to push.
VertexConstraint constraint_of(const ContactStep& step, const Points& positions, const Vector3d& needed,
                               int i, std::span<Touch> touches) {
  VertexConstraint constraint;
  constraint.vertex = i;
  const bool slipped = find_slips(way_of(step, positions, i), touches) > resting_slip;
  find_normal_forces(needed, slipped, touches);
  int held = 0;
  for (const Touch& touch : touches) {
    if (!touch.holds) continue;
    constraint.friction_bound += friction_bound_of(touch);
    constraint.slip_direction = touch.slip_direction;
    ++held;
  }
  if (held == 0) return constraint;

  const double bound = constraint.friction_bound;
  const Matrix3d along = along_surfaces(touches);
  const Vector3d needed_tangential = along * needed;
  if (!slipped && needed_tangential.norm() <= bound) {
    constraint.freedom = Freedom::stick;
    constraint.free.setZero();
    constraint.reaction = needed;
    for (Touch& touch : touches)
      if (touch.holds && bound > 0) touch.friction = friction_bound_of(touch) / bound * needed_tangential;
    return constraint;
  }
  constraint.freedom = Freedom::slip;
  constraint.free = along;
  if (!slipped) {
    constraint.slip_direction = -needed_tangential / needed_tangential.norm();
  } else if (held > 1) {
    const Vector3d slip = slip_of(step, positions, i, touches);
    constraint.slip_direction = slip / smooth_length(slip.norm());
  }
  for (Touch& touch : touches) {
    if (!touch.holds) continue;
    const double own_bound = friction_bound_of(touch);
    const Vector3d& direction = slipped ? touch.slip_direction : constraint.slip_direction;
    touch.friction = -own_bound * direction;
    constraint.reaction += touch.normal_force * touch.normal + touch.friction;
    if (slipped)
      constraint.slip_stiffness += own_bound / touch.slip *
                                   (Matrix3d::Identity() - touch.normal * touch.normal.transpose() -
                                    direction * direction.transpose());
  }
  return constraint;
}

}  // namespace

ContactStep::ContactStep(const Sheet& sheet_in, const Environment& environment_in, double time_step_in,
                         const WayOut<double>& way_out_in)
    : sheet(sheet_in),
      environment(environment_in),
      time(environment_in.state.time + time_step_in),
      time_step(time_step_in),
      way_out(way_out_in),
      obstacles(moving_obstacles(environment_in, environment_in.state.time, time)),
      several(stand_beside(environment_in.obstacles)) {}

ObstacleStep<double> ContactStep::view() const {
  return {obstacles.data(), static_cast<int>(obstacles.size()), several, time_step, way_out};
}

SurfaceGap<double> ContactStep::gap(int obstacle, const Points& positions, int i) const {
  return gap_in_step(view(), obstacle, vector3(environment.state.positions, i), vector3(positions, i));
}

bool ContactStep::is_far(int obstacle, const Points& positions, int i) const {
  return several &&
         far_gap(obstacles[obstacle], vector3(environment.state.positions, i), vector3(positions, i)) > 0;
}

double ContactStep::distance_at_start(int obstacle, int i) const {
  return sim::distance_at_start(obstacles[obstacle], vector3(environment.state.positions, i));
}

ContactSet begin_step(const ContactStep& step, Points& positions) {
  const Environment& environment = step.environment;
  ContactSet contacts;
  contacts.obstacles = environment.obstacles.size();
  contacts.place.assign(positions.rows(), -1);
  const auto constraint_of_held = [&](int vertex) -> VertexConstraint& {
    if (contacts.place[vertex] < 0) {
      contacts.place[vertex] = static_cast<int>(contacts.constraints.size());
      contacts.constraints.push_back({.vertex = vertex, .freedom = Freedom::held});
    }
    return contacts.constraints[contacts.place[vertex]];
  };
  for (size_t k = 0; k < environment.holds.size(); ++k) {
    const Hold& hold = environment.holds[k];
    const HeldVertices& held = environment.state.held[k];
    if (held.vertices.empty()) continue;
    const Eigen::Isometry3d frame = frame_pose(environment, hold.frame, step.time);
    const Points places = held_places(hold, held, step.time);
    for (size_t v = 0; v < held.vertices.size(); ++v) {
      const int vertex = held.vertices[v];
      const Vector3d place = frame * places.row(v).transpose();
      VertexConstraint& constraint = constraint_of_held(vertex);
      for (int axis = 0; axis < 3; ++axis) {
        if (!hold.axes[axis]) continue;
        constraint.free(axis, axis) = 0;
        constraint.holds[axis] = static_cast<int>(k);
        positions(vertex, axis) = place[axis];
      }
    }
  }
  contacts.held = contacts.constraints.size();
  return contacts;
}

void add_hold_forces(const VertexConstraint& constraint, const Vector3d& reaction,
                     std::vector<Vector3d>& forces) {
  for (int axis = 0; axis < 3; ++axis)
    if (constraint.holds[axis] >= 0) forces[constraint.holds[axis]][axis] += reaction[axis];
}

void find_clearance(const ContactStep& step, const Points& positions, std::vector<double>& clearance) {
  clearance.assign(positions.rows(), std::numeric_limits<double>::infinity());
  const ObstacleStep<double> obstacles = step.view();
  for (int k = 0; k < obstacles.count; ++k)
    for (int i = 0; i < positions.rows(); ++i) {
      const Vector3<double> start = vector3(step.environment.state.positions, i),
                            point = vector3(positions, i);
      if (obstacles.several && clearance[i] <= far_gap(obstacles.obstacles[k], start, point)) continue;
      clearance[i] = std::min(clearance[i], distance_in_step(obstacles, k, start, point));
    }
}

void add_touches(const ContactStep& step, const Points& positions, int i, std::vector<Touch>& touches) {
  const int body = body_of(step.sheet, i);
  for (int k = 0; k < static_cast<int>(step.obstacles.size()); ++k) {
    const SurfaceGap<double> gap = step.gap(k, positions, i);
    touches.push_back(
        {.obstacle = k,
         .gap = gap.distance,
         .starts_inside = gap.starts_inside,
         .friction_coefficient = friction_between(step.environment, step.environment.obstacles[k], body),
         .normal = vector3d(gap.normal),
         .curvature_direction = vector3d(gap.curvature_direction),
         .surface_moved = vector3d(gap.surface_moved)});
  }
}

void update_contacts(const ContactStep& step, const Points& positions, const Points& force,
                     ContactSet& contacts) {
  for (size_t k = contacts.held; k < contacts.constraints.size(); ++k)
    contacts.place[contacts.constraints[k].vertex] = -1;
  contacts.constraints.resize(contacts.held);
  contacts.touches.clear();
  for (VertexConstraint& constraint : contacts.constraints) {
    const Vector3d needed = force.row(constraint.vertex);
    constraint.reaction = needed - constraint.free * needed;
  }
  find_clearance(step, positions, contacts.clearance);
  for (int i = 0; i < positions.rows(); ++i) {
    if (contacts.place[i] >= 0 || contacts.clearance[i] > touching_gap) continue;
    const size_t first = contacts.touches.size();
    add_touches(step, positions, i, contacts.touches);
    VertexConstraint constraint =
        constraint_of(step, positions, force.row(i), i, std::span(contacts.touches).subspan(first));
    if (constraint.freedom == Freedom::free) {
      contacts.touches.resize(first);
      continue;
    }
    contacts.place[i] = static_cast<int>(contacts.constraints.size());
    contacts.constraints.push_back(constraint);
  }
}

std::vector<Matrix3d> friction_couplings(const ContactSet& contacts) {
  std::vector<Matrix3d> couplings;
  for (size_t k = 0; k < contacts.constraints.size(); ++k) {
    Matrix3d normals = Matrix3d::Zero(), rubs = Matrix3d::Zero(), gram = Matrix3d::Identity();
    int count = 0;
    if (contacts.constraints[k].freedom == Freedom::slip) {
      for (const Touch& touch : contacts.touches_of(k)) {
        if (!touch.holds) continue;
        normals.col(count) = touch.normal;
        rubs.col(count++) = touch.friction_coefficient * touch.slip_direction;
      }
    }
    gram.topLeftCorner(count, count) =
        normals.leftCols(count).transpose() * (normals.leftCols(count) - rubs.leftCols(count));
    couplings.push_back(rubs * gram.inverse() * normals.transpose());
  }
  return couplings;
}

double friction_potential(const ContactStep& step, const ContactSet& contacts, const Points& positions) {
  double potential = 0;
  for (size_t k = contacts.held; k < contacts.constraints.size(); ++k) {
    const VertexConstraint& constraint = contacts.constraints[k];
    if (constraint.friction_bound == 0) continue;
    for (const Touch& touch : contacts.touches_of(k)) {
      if (!touch.holds) continue;
      const SurfaceGap<double> gap = step.gap(touch.obstacle, positions, constraint.vertex);
      const Vector3<double> moved = vector3(way_of(step, positions, constraint.vertex)) - gap.surface_moved;
      const double slip = norm(moved - dot(gap.normal, moved) * gap.normal);
      potential +=
          friction_bound_of(touch) * (constraint.slip_stiffness.isZero(0) ? slip : smooth_length(slip));
    }
  }
  return potential;
}

Vector3d slip_of(const ContactStep& step, const Points& positions, int vertex,
                 std::span<const Touch> touches) {
  Vector3d surfaces_moved = Vector3d::Zero();
  double weights = 0;
  constexpr double least_weight = 1e-300;  // surfaces without friction count alike
  std::array<Vector3d, 3> normals;
  size_t count = 0;
  for (const Touch& touch : touches) {
    if (!touch.holds) continue;
    const SurfaceGap<double> gap = step.gap(touch.obstacle, positions, vertex);
    const double weight = friction_bound_of(touch) + least_weight;
    surfaces_moved += weight * vector3d(gap.surface_moved);
    weights += weight;
    normals[count++] = vector3d(gap.normal);
  }
  const Vector3d against = way_of(step, positions, vertex) - surfaces_moved / weights;
  if (count == 1) return against - normals[0] * normals[0].dot(against);
  if (count > 2) return Vector3d::Zero();
  const Vector3d edge = normals[0].cross(normals[1]).normalized();
  return edge * edge.dot(against);
}

}  // namespace flash::sim
