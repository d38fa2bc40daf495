#include "sim/newton/active_set.h"

#include <algorithm>
#include <limits>

namespace flash::sim {

using data::Points;
using Eigen::Map;
using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {

constexpr double least_depth = 1e-12;  ///< to which a direction has to sink a vertex, above rounding [m]
constexpr double least_inward = 1e-6;  ///< squared length of the part of a normal that is free

Map<Matrix3d> block(BlockValues<double>& values, size_t k) { return Map<Matrix3d>(values.data() + 9 * k); }

}  // namespace

void add_slip_stiffness(const ContactSet& contacts, BlockValues<double>& values) {
  for (const VertexConstraint& c : contacts.constraints)
    if (c.freedom == Freedom::slip) block(values, c.vertex) += c.free * c.slip_stiffness * c.free;
}

void add_surface_curvature(const ContactSet& contacts, BlockValues<double>& values) {
  for (size_t k = contacts.held; k < contacts.constraints.size(); ++k)
    for (const Touch& touch : contacts.touches_of(k))
      if (touch.holds && !touch.curvature_direction.isZero(0))
        block(values, contacts.constraints[k].vertex) -=
            touch.normal_force * touch.curvature_direction * touch.curvature_direction.transpose();
}

void restrict_matrix(const BlockPattern& pattern, const ContactSet& contacts, BlockValues<double>& values) {
  for (const VertexConstraint& c : contacts.constraints) {
    if (c.freedom == Freedom::free) continue;
    auto own = block(values, c.vertex);
    own = c.free * own * c.free + own.trace() / 3 * (Matrix3d::Identity() - c.free);
  }
  for (size_t k = 0; k < pattern.pairs.size(); ++k) {
    const auto [row, column] = pattern.pairs[k];
    if (contacts.place[row] < 0 && contacts.place[column] < 0) continue;
    auto between = block(values, pattern.size + k);
    for (const bool left : {true, false}) {
      const VertexConstraint* c = contacts.find(left ? row : column);
      if (c == nullptr || c->freedom == Freedom::free) continue;
      if (c->freedom == Freedom::stick)
        between.setZero();
      else if (left)
        between = c->free * between;
      else
        between = between * c->free;
    }
  }
}

namespace {

/// Frees a vertex from the touches that would have to pull. Returns whether any touch was released.
bool release(const Vector3d& force, VertexConstraint& c, std::span<Touch> touches) {
  const auto holds = [](const Touch& touch) { return touch.holds; };
  const auto held = std::count_if(touches.begin(), touches.end(), holds);
  for (Touch& touch : touches) touch.released = touch.released || touch.holds;
  share_force(touches, force, holds);
  for (Touch& touch : touches) touch.released = touch.released && !touch.holds;
  const auto still_held = std::count_if(touches.begin(), touches.end(), holds);
  if (still_held == held) return false;
  c.freedom = still_held > 0 ? Freedom::slip : Freedom::free;
  c.free = along_surfaces(touches);
  c.correction -= c.free * c.correction;
  return true;
}

/// Holds a vertex on the touches up to `reach` away that `step` drives it into. Returns whether any touch was
/// added.
bool hold(const Vector3d& step, double reach, VertexConstraint& c, std::span<Touch> touches) {
  bool any = false;
  for (Touch& touch : touches) {
    if (touch.holds || touch.released || touch.gap > reach ||
        touch.gap + touch.normal.dot(step) >= -least_depth)
      continue;
    // The correction stays within the surfaces that hold already.
    const Vector3d inward = c.free * touch.normal;
    if (inward.squaredNorm() < least_inward) continue;
    c.correction += (-touch.gap - touch.normal.dot(c.correction)) / inward.squaredNorm() * inward;
    touch.holds = true;
    c.freedom = Freedom::slip;
    c.free = along_surfaces(touches);
    any = true;
  }
  return any;
}

/// Holds a vertex that nothing holds so far. Returns whether it is held now.
bool hold_free(const Linearization& iterate, const Vector3d& step, double reach, int i,
               ContactSet& contacts) {
  const double clearance = contacts.clearance[i];
  if (clearance > reach || clearance > step.norm()) return false;
  const size_t first = contacts.touches.size();
  add_touches(iterate.step, iterate.positions, i, contacts.touches);
  VertexConstraint constraint{.vertex = i};
  if (!hold(step, reach, constraint, std::span(contacts.touches).subspan(first))) {
    contacts.touches.resize(first);
    return false;
  }
  contacts.place[i] = static_cast<int>(contacts.constraints.size());
  contacts.constraints.push_back(constraint);
  return true;
}

bool hold_free_vertices(const Linearization& iterate, const Points& direction, double reach,
                        ContactSet& contacts) {
  bool any = false;
  for (int i = 0; i < direction.rows(); ++i)
    if (contacts.place[i] < 0) any = hold_free(iterate, direction.row(i), reach, i, contacts) || any;
  return any;
}

}  // namespace

bool exchange_contacts(const Linearization& iterate, const Points& direction, const Points& force,
                       Points& gradient, ContactSet& contacts) {
  constexpr double any_reach = std::numeric_limits<double>::infinity();
  bool any = false;
  for (size_t k = contacts.held; k < contacts.constraints.size(); ++k) {
    VertexConstraint& c = contacts.constraints[k];
    const std::span<Touch> touches = contacts.touches_of(k);
    const int i = c.vertex;
    if (c.freedom != Freedom::free && release(force.row(i), c, touches)) {
      gradient.row(i) = c.freedom == Freedom::free ? iterate.force.row(i) : iterate.residual.row(i);
      any = true;
    } else if (c.freedom != Freedom::stick && hold(direction.row(i), any_reach, c, touches)) {
      any = true;
    }
  }
  return hold_free_vertices(iterate, direction, any_reach, contacts) || any;
}

bool hold_touching(const Linearization& iterate, const Points& direction, ContactSet& contacts) {
  bool any = false;
  for (size_t k = contacts.held; k < contacts.constraints.size(); ++k) {
    VertexConstraint& c = contacts.constraints[k];
    if (c.freedom == Freedom::free || c.freedom == Freedom::slip)
      any = hold(direction.row(c.vertex), touching_gap, c, contacts.touches_of(k)) || any;
  }
  return hold_free_vertices(iterate, direction, touching_gap, contacts) || any;
}

}  // namespace flash::sim
