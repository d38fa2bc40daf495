#pragma once
#include <string>
#include <vector>

#include "data/scene/scene.h"
#include "sim/scene/scene.h"
#include "sim/step/between_vertices.h"

namespace flash::sim {

/// Of solids whose mesh is stiffer in bending than their material by a tenth or more: of those at least twice
/// as long as thick, which bend, and of all where Poisson's ratio adds as much.
std::vector<std::string> stiff_mesh_warnings(const std::vector<SceneBody>& bodies);

/// Of sheets with vertices in one place that are not joined.
std::vector<std::string> seam_warnings(const std::vector<SceneBody>& bodies);

/// The most tetrahedra of a solid that have collapsed at the end of a step.
struct Collapse {
  int elements = 0;
  double time = 0;  ///< [s]
};

/// Of solid `number` of `in`, where it stands at the end.
std::string collapse_warning(const SceneBody& in, int number, const Collapse& worst);

inline constexpr double told_coming_through = 1e-3;  ///< of an obstacle between vertices [m]

/// Of bodies that an obstacle came through between their vertices; `deepest`: of each, at any time of the
/// run.
std::vector<std::string> coming_through_warnings(const std::vector<SceneBody>& bodies,
                                                 const std::vector<ComingThrough>& deepest);

/// Keyframes after the last step, which are not written.
std::vector<std::string> keyframe_warnings(const data::Scene& scene, int steps);

}  // namespace flash::sim
