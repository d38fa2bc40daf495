#pragma once
#include <string>
#include <vector>

#include "data/scene.h"
#include "sim/scene/environment.h"
#include "sim/scene/sheet.h"

namespace flash::sim {

/// A scene, ready to step: its objects are the bodies of one environment.
struct SimulatedScene {
  Sheet sheet;  ///< vertex_area carries the mass, even where the asset spreads it evenly over the vertices
  Environment environment;
};

/// The scene with a schedule for `steps` steps. What was understood of units and what cannot be done goes to
/// `notices`. Throws data::InputError: solids, start positions that do not fit the mesh, vertices out of
/// range.
SimulatedScene simulated_scene(const data::Scene& scene, int steps, std::vector<std::string>& notices);

}  // namespace flash::sim
