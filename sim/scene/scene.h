#pragma once
#include <string>
#include <vector>

#include "data/scene/scene.h"
#include "sim/scene/environment.h"
#include "sim/scene/sheet.h"

namespace flash::sim {

/// One object of a scene, ready to step.
struct SceneBody {
  std::string name;  ///< of several objects that meet: all names
  Sheet sheet;  ///< vertex_area, of a solid vertex_volume, carries the mass: even where the asset spreads its
                ///< mass evenly over the vertices
  Environment environment;
};

/// The objects of a scene, on one schedule for `steps` steps; with self-contact all in one body. What was
/// understood of units and what cannot be done goes to `notices`. Throws data::InputError: start positions
/// that do not fit the mesh or turn a tetrahedron inside out, vertices out of range.
std::vector<SceneBody> scene_bodies(const data::Scene& scene, int steps, std::vector<std::string>& notices);

}  // namespace flash::sim
