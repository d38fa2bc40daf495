#include "sim/step/contact_set.h"

#include <Eigen/Geometry>
#include <algorithm>

namespace flash::sim {

using data::Points;
using Eigen::Matrix3d;
using Eigen::Vector3d;

ContactStep::ContactStep(const Sheet& sheet_in, const Environment& environment_in, double time_step_in,
                         const WayOut<double>& way_out_in)
    : sheet(sheet_in),
      environment(environment_in),
      time(environment_in.state.time + time_step_in),
      time_step(time_step_in),
      way_out(way_out_in),
      several(stand_beside(environment_in.obstacles)) {
  const std::vector<MovingObstacle<double>> each =
      moving_obstacles(environment, environment.state.time, time);
  for (std::size_t k = 0; k < each.size(); ++k) {
    const int surfaces = surfaces_of(environment.obstacles[k]);
    if (surfaces > 1) memories_.push_back(std::make_unique<MeshMemory>());
    for (int surface = 0; surface < surfaces; ++surface) {
      obstacles.push_back(each[k]);
      obstacles.back().surface = surface;
      if (surfaces > 1) obstacles.back().memory = memories_.back().get();
      owners.push_back(static_cast<int>(k));
    }
  }
  for (std::size_t body = 1; body < sheet.bodies.size() && !obstacles.empty(); ++body) {
    others_.push_back(obstacles);
    for (std::size_t k = 0; k < obstacles.size(); ++k)
      others_.back()[k].friction =
          friction_between(environment, environment.obstacles[owners[k]], static_cast<int>(body));
  }
}

ObstacleStep<double> ContactStep::view() const {
  return {obstacles.data(), static_cast<int>(obstacles.size()), several, time_step, way_out};
}

ObstacleStep<double> ContactStep::view_of(int i) const {
  ObstacleStep<double> all = view();
  if (others_.empty()) return all;
  const int body = body_of(sheet, i);
  if (body > 0) all.obstacles = others_[static_cast<std::size_t>(body) - 1].data();
  return all;
}

SurfaceGap<double> ContactStep::gap(int obstacle, const Points& positions, int i) const {
  return gap_in_step(view(), obstacle, start(i), vector3(positions, i));
}

double ContactStep::distance_at_start(int obstacle, int i) const {
  return sim::distance_at_start(obstacles[obstacle], start(i));
}

ContactSet begin_step(const ContactStep& step, Points& positions) {
  const Environment& environment = step.environment;
  ContactSet contacts;
  contacts.obstacles = step.obstacles.size();
  contacts.place.assign(positions.rows(), -1);
  const auto constraint_of_held = [&](int vertex) -> VertexConstraint& {
    if (contacts.place[vertex] < 0) {
      contacts.place[vertex] = static_cast<int>(contacts.constraints.size());
      contacts.constraints.push_back({{.freedom = Freedom::held}, vertex});
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
      if (!is_rigid(hold, v)) continue;
      const int vertex = held.vertices[v];
      const Vector3d place = frame * places.row(v).transpose();
      VertexConstraint& constraint = constraint_of_held(vertex);
      for (int axis = 0; axis < 3; ++axis) {
        if (!hold.axes[axis]) continue;
        (axis == 0 ? constraint.free.xx : axis == 1 ? constraint.free.yy : constraint.free.zz) = 0;
        constraint.holds[axis] = static_cast<int>(k);
        positions(vertex, axis) = place[axis];
      }
    }
  }
  contacts.held = contacts.constraints.size();
  return contacts;
}

void add_hold_forces(const VertexConstraint& constraint, const Vector3<double>& reaction,
                     std::vector<Vector3d>& forces) {
  for (int axis = 0; axis < 3; ++axis)
    if (constraint.holds[axis] >= 0) forces[constraint.holds[axis]][axis] += reaction[axis];
}

void find_clearance(const ContactStep& step, const Points& positions, std::vector<double>& clearance) {
  const ObstacleStep<double> view = step.view();
  clearance.resize(static_cast<std::size_t>(positions.rows()));
  for (int i = 0; i < positions.rows(); ++i)
    clearance[i] = clearance_of(view, step.start(i), vector3(positions, i));
}

VertexTouch* add_touches(const ContactStep& step, const Points& positions, int i, ContactSet& contacts) {
  const std::size_t first = contacts.touches.size();
  contacts.touches.resize(first + contacts.obstacles);
  VertexTouch* touches = contacts.touches.data() + first;
  const ObstacleStep<double> view = step.view();
  find_touches(view, step.start(i), vector3(positions, i), touches);
  carry_bristles(
      view, [&](int obstacle) { return step.bristle(obstacle, i); }, touches);
  return touches;
}

void update_contacts(const ContactStep& step, const Points& positions, const Points& force,
                     ContactSet& contacts) {
  for (size_t k = contacts.held; k < contacts.constraints.size(); ++k)
    contacts.place[contacts.constraints[k].vertex] = -1;
  contacts.constraints.resize(contacts.held);
  contacts.touches.clear();
  for (VertexConstraint& constraint : contacts.constraints) {
    const Vector3<double> needed = vector3(force, constraint.vertex);
    constraint.reaction = needed - constraint.free * needed;
  }
  find_clearance(step, positions, contacts.clearance);
  ContactRoom room(contacts.obstacles);
  for (int i = 0; i < positions.rows(); ++i) {
    if (contacts.place[i] >= 0 || contacts.clearance[i] > touching_gap) continue;
    VertexTouch* touches = add_touches(step, positions, i, contacts);
    const VertexContact contact = decide_contact(step.view_of(i), step.start(i), vector3(positions, i),
                                                 vector3(force, i), touches, room);
    if (contact.freedom == Freedom::free) {
      contacts.touches.resize(contacts.touches.size() - contacts.obstacles);
      continue;
    }
    contacts.place[i] = static_cast<int>(contacts.constraints.size());
    contacts.constraints.push_back({contact, i});
  }
}

std::vector<Matrix3d> friction_couplings(const ContactStep& step, const ContactSet& contacts) {
  std::vector<Matrix3d> couplings(contacts.constraints.size(), Matrix3d::Zero());
  for (size_t k = contacts.held; k < couplings.size(); ++k) {
    const VertexConstraint& constraint = contacts.constraints[k];
    for (int axis = 0; axis < 3; ++axis)
      couplings[k].col(axis) = vector3d(friction_coupling(step.view_of(constraint.vertex), constraint,
                                                          contacts.touches_of(k).data(), axis));
  }
  return couplings;
}

double friction_potential(const ContactStep& step, const ContactSet& contacts, const Points& positions) {
  double potential = 0;
  for (size_t k = contacts.held; k < contacts.constraints.size(); ++k) {
    const VertexConstraint& constraint = contacts.constraints[k];
    const int i = constraint.vertex;
    potential += friction_potential_of(step.view_of(i), step.start(i), vector3(positions, i), constraint,
                                       contacts.touches_of(k).data());
  }
  return potential;
}

namespace {

/// The bristles of a mesh on a vertex in a crease: what they bend by along each of its surfaces that hold it,
/// as one vector. It is cut as that along which it slides farthest.
Vector3<double> bristles_in_crease(const ContactStep& step, std::span<const VertexTouch> touches,
                                   const Vector3<double>& moved) {
  double farthest = 0;
  Vector3<double> bent{};
  for (const VertexTouch& touch : touches) {
    if (!touch.holds) continue;
    farthest = std::max(farthest, touch.slip);
    bent = touch.bristle + moved - touch.surface_moved;
  }
  return (1 / friction_length(farthest, step.time_step)) * bent;
}

}  // namespace

Points bristles_at_end(const ContactStep& step, const ContactSet& contacts, const Points& positions) {
  const Eigen::Index vertices = step.environment.state.positions.rows();
  Points bristles = Points::Zero(static_cast<Eigen::Index>(step.environment.obstacles.size()) * vertices, 3);
  for (size_t k = contacts.held; k < contacts.constraints.size(); ++k) {
    const int i = contacts.constraints[k].vertex;
    const ObstacleStep<double> view = step.view_of(i);
    const std::span<const VertexTouch> touches = contacts.touches_of(k);
    for (size_t first = 0, count = 0; first < touches.size(); first += count) {
      const int owner = step.owners[first];
      count = static_cast<size_t>(surfaces_of(step.environment.obstacles[owner]));
      const std::span<const VertexTouch> own = touches.subspan(first, count);
      Vector3<double> bristle{};
      int held = 0;
      for (size_t each = 0; each < count; ++each) {
        if (!own[each].holds) continue;
        bristle = bristle_at_end(view.obstacles[first], own[each]);
        ++held;
      }
      if (held > 1 && view.obstacles[first].friction > 0)
        bristle = bristles_in_crease(step, own, vector3(positions, i) - step.start(i));
      bristles.row(owner * vertices + i) = vector3d(bristle).transpose();
    }
  }
  return bristles;
}

}  // namespace flash::sim
