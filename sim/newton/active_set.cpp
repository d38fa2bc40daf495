#include "sim/newton/active_set.h"

#include "sim/law/contact_exchange.h"

namespace flash::sim {

using data::Points;
using Eigen::Map;
using Eigen::Matrix3d;

namespace {

Map<Matrix3d> block(BlockValues<double>& values, size_t k) { return Map<Matrix3d>(values.data() + 9 * k); }

}  // namespace

void add_slip_stiffness(const ContactSet& contacts, BlockValues<double>& values) {
  for (const VertexConstraint& c : contacts.constraints)
    if (c.freedom == Freedom::slip) block(values, c.vertex) += matrix3d(restricted(c.slip_stiffness, c.free));
}

void add_surface_curvature(const ContactSet& contacts, BlockValues<double>& values) {
  for (size_t k = contacts.held; k < contacts.constraints.size(); ++k)
    for (const VertexTouch& touch : contacts.touches_of(k))
      if (touch.holds && !(is_zero(touch.curvature_direction) && touch.ball_curvature == 0))
        block(values, contacts.constraints[k].vertex) -= matrix3d(touch.normal_force * curvature_of(touch));
}

void restrict_matrix(const BlockPattern& pattern, const ContactSet& contacts, BlockValues<double>& values) {
  for (const VertexConstraint& c : contacts.constraints) {
    if (c.freedom == Freedom::free) continue;
    auto own = block(values, c.vertex);
    const Matrix3d free = matrix3d(c.free), held = Matrix3d::Identity() - free;
    own = free * own * free + held * own * held;
  }
  for (size_t k = 0; k < pattern.pairs.size(); ++k) {
    const auto [row, column] = pattern.pairs[k];
    if (contacts.place[row] < 0 && contacts.place[column] < 0) continue;
    auto between = block(values, pattern.size + k);
    for (const bool left : {true, false}) {
      const VertexConstraint* c = contacts.find(left ? row : column);
      if (c == nullptr || c->freedom == Freedom::free) continue;
      if (left)
        between = matrix3d(c->free) * between;
      else
        between = between * matrix3d(c->free);
    }
  }
}

namespace {

/// Holds a vertex that nothing holds so far. Returns whether it is held now.
bool hold_free(const Linearization& iterate, const Vector3<double>& way, double reach, int i,
               ContactSet& contacts) {
  const double clearance = contacts.clearance[i];
  if (clearance > reach || clearance > norm(way)) return false;
  VertexTouch* touches = add_touches(iterate.step, iterate.positions, i, contacts);
  VertexContact contact;
  if (!hold(iterate.step.view(), way, reach, contact, touches)) {
    contacts.touches.resize(contacts.touches.size() - contacts.obstacles);
    return false;
  }
  contacts.place[i] = static_cast<int>(contacts.constraints.size());
  contacts.constraints.push_back({contact, i});
  return true;
}

bool hold_free_vertices(const Linearization& iterate, const Points& direction, double reach,
                        ContactSet& contacts) {
  bool any = false;
  for (int i = 0; i < direction.rows(); ++i)
    if (contacts.place[i] < 0) any = hold_free(iterate, vector3(direction, i), reach, i, contacts) || any;
  return any;
}

}  // namespace

bool exchange_contacts(const Linearization& iterate, const Points& direction, const Points& force,
                       Points& gradient, ContactSet& contacts) {
  constexpr double any_reach = no_such_side;
  const ObstacleStep<double> view = iterate.step.view();
  ContactRoom room(contacts.obstacles);
  bool any = false;
  for (size_t k = contacts.held; k < contacts.constraints.size(); ++k) {
    VertexConstraint& c = contacts.constraints[k];
    VertexTouch* touches = contacts.touches_of(k).data();
    const int i = c.vertex;
    if (c.freedom != Freedom::free && release(view, vector3(force, i), c, touches, room)) {
      gradient.row(i) = c.freedom == Freedom::free ? iterate.force.row(i) : iterate.residual.row(i);
      any = true;
    } else if (hold(view, vector3(direction, i), any_reach, c, touches)) {
      any = true;
    }
  }
  return hold_free_vertices(iterate, direction, any_reach, contacts) || any;
}

bool hold_touching(const Linearization& iterate, const Points& direction, ContactSet& contacts) {
  const ObstacleStep<double> view = iterate.step.view();
  bool any = false;
  for (size_t k = contacts.held; k < contacts.constraints.size(); ++k) {
    VertexConstraint& c = contacts.constraints[k];
    any = hold(view, vector3(direction, c.vertex), touching_gap, c, contacts.touches_of(k).data()) || any;
  }
  return hold_free_vertices(iterate, direction, touching_gap, contacts) || any;
}

}  // namespace flash::sim
