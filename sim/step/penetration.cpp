#include "sim/step/penetration.h"

namespace flash::sim {

Penetration deepest_held(const ContactStep& step, const ContactSet& contacts, const data::Points& positions) {
  Penetration deepest;
  for (size_t j = 0; j < contacts.fixed; ++j) {
    const int i = contacts.constraints[j].vertex;
    for (int k = 0; k < static_cast<int>(step.motions.size()); ++k) {
      const Gap gap = step.gap(k, positions, i);
      const double depth = gap.sunk - gap.distance;
      if (depth > deepest.depth) deepest = {depth, i, k};
    }
  }
  return deepest;
}

Penetration deepest_at_start(const ContactStep& step, const ContactSet& contacts, double tolerance) {
  const Environment& environment = step.environment;
  Penetration deepest;
  for (int k = 0; k < static_cast<int>(step.motions.size()); ++k) {
    ObstacleMotion at_start = step.motions[k];
    at_start.end = at_start.start;
    for (int i = 0; i < environment.state.positions.rows(); ++i) {
      if (contacts.place[i] >= 0 && contacts.constraints[contacts.place[i]].hold == Hold::fixed) continue;
      const double depth =
          -gap_to(environment.obstacles[k], at_start, environment.state.positions.row(i)).distance;
      if (depth > tolerance && depth > deepest.depth) deepest = {depth, i, k};
    }
  }
  return deepest;
}

}  // namespace flash::sim
