#pragma once
#include <string>
#include <vector>

#include "sim/scene/scene.h"
#include "sim/step/contact_force.h"

namespace flash::sim {

/// The contacts of each body's environment as CSV, a row each, with a line of names: kind (vertex_obstacle,
/// vertex_face, edge_edge), body, other, v0 to v3 as in ContactForce but counted through all bodies (-1:
/// none), x to z and other_x to other_z, normal_x to normal_z, normal_force, friction_x to friction_z,
/// couple_x to couple_z [m, N, N m].
std::string contact_table(const std::vector<SceneBody>& bodies,
                          const std::vector<std::vector<ContactForce>>& contacts);

inline constexpr const char* resultant_columns = "t,body,fx,fy,fz,tx,ty,tz\n";

/// Rows of what the contacts do to each object and each obstacle, by their names: force and torque about the
/// origin of the base frame [N, N m].
std::string resultant_rows(double time, const std::vector<SceneBody>& bodies,
                           const std::vector<std::vector<ContactForce>>& contacts);

}  // namespace flash::sim
