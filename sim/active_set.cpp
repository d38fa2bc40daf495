#include "sim/active_set.h"

#include <algorithm>
#include <limits>

namespace flash::sim {

using data::Points;
using Eigen::Map;
using Eigen::Matrix3d;
using Eigen::Vector3d;

void add_slip_stiffness(const std::vector<VertexConstraint>& constraints, BlockValues<double>& values) {
  for (size_t i = 0; i < constraints.size(); ++i) {
    const VertexConstraint& c = constraints[i];
    if (c.hold == Hold::slip) Map<Matrix3d>(values.data() + 9 * i) += c.free * c.slip_stiffness * c.free;
  }
}

void add_surface_curvature(const std::vector<VertexConstraint>& constraints, BlockValues<double>& values) {
  for (size_t i = 0; i < constraints.size(); ++i)
    for (const Touch& touch : constraints[i].touches)
      if (touch.holds)
        Map<Matrix3d>(values.data() + 9 * i) -= touch.normal_force * touch.curved * touch.curved.transpose();
}

void restrict_matrix(const BlockPattern& pattern, const std::vector<VertexConstraint>& constraints,
                     BlockValues<double>& values) {
  const auto block = [&](size_t k) { return Map<Matrix3d>(values.data() + 9 * k); };
  const auto is_free = [&](int i) { return constraints[i].hold == Hold::free; };
  for (int i = 0; i < pattern.size; ++i) {
    if (is_free(i)) continue;
    const Matrix3d& P = constraints[i].free;
    block(i) = P * block(i) * P + block(i).trace() / 3 * (Matrix3d::Identity() - P);
  }
  for (size_t k = 0; k < pattern.pairs.size(); ++k) {
    const auto [row, column] = pattern.pairs[k];
    if (is_free(row) && is_free(column)) continue;
    auto b = block(pattern.size + k);
    b = constraints[row].free * b * constraints[column].free;
  }
}

namespace {

/// Frees a vertex from the touches that would have to pull. Returns whether from any.
bool release(const Vector3d& force, VertexConstraint& c) {
  std::vector<bool> held;
  for (const Touch& touch : c.touches) held.push_back(touch.holds);
  const std::vector<double> normal = normal_forces(c.touches, held, force);
  bool any = false, still_held = false;
  for (size_t k = 0; k < c.touches.size(); ++k) {
    if (held[k] && normal[k] == 0) any = c.touches[k].let_go = true;
    c.touches[k].holds = held[k] && normal[k] > 0;
    still_held = still_held || c.touches[k].holds;
  }
  if (!any) return false;
  c.hold = still_held ? Hold::slip : Hold::free;
  c.free = still_held ? along_surfaces(c.touches) : Matrix3d(Matrix3d::Identity());
  c.correction -= c.free * c.correction;
  return true;
}

/// Holds a vertex on the touches up to `reach` away that `step` drives it into. Returns whether on any.
bool hold(const Vector3d& step, double reach, VertexConstraint& c) {
  bool any = false;
  for (Touch& touch : c.touches) {
    if (touch.holds || touch.let_go || touch.gap > reach || touch.gap + touch.normal.dot(step) >= -1e-12)
      continue;
    // Within the surfaces that hold already, up to the edge.
    const Vector3d inward = c.free * touch.normal;
    if (inward.squaredNorm() < 1e-6) continue;
    c.correction += (-touch.gap - touch.normal.dot(c.correction)) / inward.squaredNorm() * inward;
    touch.holds = true;
    c.hold = Hold::slip;
    c.free = along_surfaces(c.touches);
    any = true;
  }
  return any;
}

}  // namespace

bool exchange_contacts(const Points& direction, const Points& force_before, const Points& residual_before,
                       const Points& force, Points& gradient, std::vector<VertexConstraint>& constraints) {
  bool any = false;
  for (size_t i = 0; i < constraints.size(); ++i) {
    VertexConstraint& c = constraints[i];
    if (c.hold == Hold::fixed) continue;
    if (c.hold != Hold::free && release(force.row(i), c)) {
      gradient.row(i) = c.hold == Hold::free ? force_before.row(i) : residual_before.row(i);
      any = true;
    } else if (c.hold != Hold::stick && hold(direction.row(i), std::numeric_limits<double>::infinity(), c)) {
      any = true;
    }
  }
  return any;
}

bool hold_touching(const Points& direction, std::vector<VertexConstraint>& constraints) {
  bool any = false;
  for (size_t i = 0; i < constraints.size(); ++i) {
    VertexConstraint& c = constraints[i];
    if (c.hold == Hold::free || c.hold == Hold::slip) any = hold(direction.row(i), touching_gap, c) || any;
  }
  return any;
}

}  // namespace flash::sim
