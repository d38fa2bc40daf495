#include "sim/step/penetration.h"

#include <algorithm>

#include "sim/step/contact_set.h"

namespace flash::sim {

namespace {

/// Whether the frame that carries the vertex is that of the obstacle: a hand is no obstacle to what it holds.
bool is_carried_by(const Environment& environment, const VertexConstraint& held, int obstacle) {
  const int frame = environment.obstacles[static_cast<std::size_t>(obstacle)].frame;
  return frame != base_frame && std::any_of(held.holds.begin(), held.holds.end(), [&](int hold) {
           return hold >= 0 && environment.holds[static_cast<std::size_t>(hold)].frame == frame;
         });
}

}  // namespace

Penetration deepest_held(const ContactStep& step, const ContactSet& contacts, const data::Points& positions) {
  Penetration deepest;
  for (size_t j = 0; j < contacts.held; ++j) {
    const int i = contacts.constraints[j].vertex;
    for (int k = 0; k < static_cast<int>(step.obstacles.size()); ++k) {
      const int owner = step.owners[k];
      if (is_carried_by(step.environment, contacts.constraints[j], owner)) continue;
      const SurfaceGap<double> gap = step.gap(k, positions, i);
      const double depth = gap.sunk - gap.distance;
      if (depth > deepest.depth) deepest = {depth, i, owner};
    }
  }
  return deepest;
}

Penetration deepest_without_room(const ContactStep& step, const ContactSet& contacts,
                                 const data::Points& positions) {
  constexpr double least_depth = 1e-9;  // [m]
  constexpr double facing = -0.99;      // of normals; surfaces that lean more leave room beside them
  Penetration deepest;
  if (step.obstacles.size() < 2) return deepest;
  std::vector<SurfaceGap<double>> gaps;
  for (int i = 0; i < positions.rows(); ++i) {
    if (!(contacts.clearance[static_cast<size_t>(i)] < -least_depth)) continue;
    const VertexConstraint* constraint = contacts.find(i);
    if (constraint != nullptr && constraint->freedom == Freedom::held) continue;
    gaps.clear();
    for (size_t k = 0; k < step.obstacles.size(); ++k)
      gaps.push_back(step.gap(static_cast<int>(k), positions, i));
    for (size_t k = 0; k < gaps.size(); ++k) {
      const double depth = -gaps[k].distance;
      if (depth <= std::max(least_depth, deepest.depth)) continue;
      const bool faced = std::any_of(gaps.begin(), gaps.end(), [&](const SurfaceGap<double>& other) {
        return other.distance < depth && dot(other.normal, gaps[k].normal) < facing;
      });
      if (faced) deepest = {depth, i, step.owners[k]};
    }
  }
  return deepest;
}

std::vector<std::vector<int>> vertices_inside(const ContactStep& step, const ContactSet& contacts) {
  std::vector<std::vector<int>> inside(step.obstacles.size());
  for (int i = 0; i < step.environment.state.positions.rows(); ++i) {
    const VertexConstraint* constraint = contacts.find(i);
    if (constraint != nullptr && constraint->freedom == Freedom::held) continue;
    for (size_t k = 0; k < step.obstacles.size(); ++k)
      if (step.obstacles[k].surface == 0 && step.distance_at_start(static_cast<int>(k), i) < -inside_depth)
        inside[k].push_back(i);
  }
  return inside;
}

Penetration deepest_at_start(const ContactStep& step, const std::vector<std::vector<int>>& inside) {
  Penetration deepest;
  for (size_t k = 0; k < inside.size(); ++k)
    for (const int i : inside[k]) {
      const double depth = -step.distance_at_start(static_cast<int>(k), i);
      if (depth > deepest.depth) deepest = {depth, i, step.owners[k]};
    }
  return deepest;
}

}  // namespace flash::sim
