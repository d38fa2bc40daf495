#include "sim/step/penetration.h"

#include "sim/step/contact_set.h"

namespace flash::sim {

Penetration deepest_held(const ContactStep& step, const ContactSet& contacts, const data::Points& positions) {
  Penetration deepest;
  for (size_t j = 0; j < contacts.held; ++j) {
    const int i = contacts.constraints[j].vertex;
    for (int k = 0; k < static_cast<int>(step.motions.size()); ++k) {
      const Gap gap = step.gap(k, positions, i);
      const double depth = gap.sunk - gap.distance;
      if (depth > deepest.depth) deepest = {depth, i, k};
    }
  }
  return deepest;
}

std::vector<std::vector<int>> vertices_inside(const ContactStep& step, const ContactSet& contacts) {
  const Environment& environment = step.environment;
  std::vector<std::vector<int>> inside(step.motions.size());
  for (int i = 0; i < environment.state.positions.rows(); ++i) {
    const VertexConstraint* constraint = contacts.find(i);
    if (constraint != nullptr && constraint->freedom == Freedom::held) continue;
    for (size_t k = 0; k < step.motions.size(); ++k)
      if (gap_at_start(environment.obstacles[k], step.motions[k], environment.state.positions.row(i))
              .distance < -inside_depth)
        inside[k].push_back(i);
  }
  return inside;
}

Penetration deepest_at_start(const ContactStep& step, const std::vector<std::vector<int>>& inside) {
  const Environment& environment = step.environment;
  Penetration deepest;
  for (size_t k = 0; k < inside.size(); ++k)
    for (const int i : inside[k]) {
      const double depth =
          -gap_at_start(environment.obstacles[k], step.motions[k], environment.state.positions.row(i))
               .distance;
      if (depth > deepest.depth) deepest = {depth, i, static_cast<int>(k)};
    }
  return deepest;
}

}  // namespace flash::sim
