#pragma once
#include "sim/step/contact_set.h"

namespace flash::sim {

/// The deepest of the vertices that supports or grippers hold below an obstacle's surface at the end of the
/// step, or took through it in the step: below the face through which the way came in.
Penetration deepest_held(const ContactStep& step, const ContactSet& contacts, const data::Points& positions);

/// The deepest of all others that started the step inside an obstacle, by more than `tolerance` [m].
Penetration deepest_at_start(const ContactStep& step, const ContactSet& contacts, double tolerance);

}  // namespace flash::sim
