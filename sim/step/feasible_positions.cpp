#include "sim/step/feasible_positions.h"

#include "sim/law/feasible_place.h"

namespace flash::sim {

void project_to_feasible(const ContactStep& step, const ContactSet& contacts, data::Points& positions) {
  std::vector<double> clearance;
  find_clearance(step, positions, clearance);
  ContactRoom room(step.obstacles.size());
  for (int i = 0; i < positions.rows(); ++i) {
    const int k = contacts.place[i];
    const Vector3<double> point = vector3(positions, i);
    Vector3<double> place = point;
    if (k < 0) {
      if (clearance[i] >= 0) continue;
      place = projected_out(step.view(), step.start(i), nullptr, point, room);
    } else {
      const VertexConstraint& constraint = contacts.constraints[k];
      if (constraint.freedom == Freedom::held) continue;
      place = feasible_place(step.view_of(i), step.start(i), constraint, contacts.touches_of(k).data(), point,
                             room);
    }
    positions.row(i) = vector3d(place).transpose();
  }
}

}  // namespace flash::sim
