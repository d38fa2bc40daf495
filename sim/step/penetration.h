#pragma once
#include <vector>

#include "data/mesh/mesh.h"

namespace flash::sim {

struct ContactStep;
struct ContactSet;

/// A vertex below the surface of an obstacle.
struct Penetration {
  double depth = 0;  ///< [m]; 0: there is none
  int vertex = -1, obstacle = -1;
};

/// The deepest vertex that a support or a gripper holds below an obstacle's surface at the end of the step.
/// Of one that was taken through the obstacle the surface is the face through which its way came in.
Penetration deepest_held(const ContactStep& step, const ContactSet& contacts, const data::Points& positions);

/// The deepest free vertex that stands below the surface of an obstacle at the end of the step, because
/// another that faces it is in its way: between them no place is left.
Penetration deepest_without_room(const ContactStep& step, const ContactSet& contacts,
                                 const data::Points& positions);

/// The vertices that start the step inside each obstacle, without those that supports or grippers hold: one
/// list an obstacle of the step, ascending; of a mesh the first alone has one.
std::vector<std::vector<int>> vertices_inside(const ContactStep& step, const ContactSet& contacts);

/// The deepest of vertices that start the step inside an obstacle, as vertices_inside finds them.
Penetration deepest_at_start(const ContactStep& step, const std::vector<std::vector<int>>& inside);

}  // namespace flash::sim
