#pragma once
#include "sim/step/contact_set.h"

namespace flash::sim {

/// Makes a trial iterate feasible: moves vertices out of the obstacles, held ones onto their surface. A slip
/// that turned against its direction is stopped at no slip, where it has to decide again.
void project_to_feasible(const ContactStep& step, const ContactSet& contacts, data::Points& positions);

}  // namespace flash::sim
