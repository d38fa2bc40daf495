#include "apps/sim/scene_warnings.h"

#include <algorithm>
#include <cmath>

#include "data/files/text.h"
#include "data/mesh/seams.h"
#include "sim/scene/bending_excess.h"
#include "sim/scene/solid.h"

namespace flash::sim {

std::vector<std::string> stiff_mesh_warnings(const std::vector<SceneBody>& bodies) {
  constexpr double told = 0.1, slender = 2;
  std::vector<std::string> warnings;
  for (const SceneBody& in : bodies)
    for (const auto& [number, solid] : in.environment.solids) {
      const Body& body = in.sheet.bodies[static_cast<std::size_t>(number)];
      const double excess = bending_excess(in.sheet, body, solid.constitutive, solid.poissons_ratio);
      const double locking = excess - bending_excess(in.sheet, body, solid.constitutive, 0);
      if (excess < told || (locking < told && slenderness(in.sheet, body) < slender)) continue;
      warnings.push_back((body.name.empty() ? in.name : body.name) +
                         ": bent, its linear tetrahedra are up to " +
                         data::format_short(std::ceil(100 * excess)) +
                         " % stiffer than their E says; take \"element_order\": 2 in the asset, or smaller "
                         "cells (docs/theory.md, Locking)");
    }
  return warnings;
}

std::vector<std::string> seam_warnings(const std::vector<SceneBody>& bodies) {
  std::vector<std::string> warnings;
  for (const SceneBody& object : bodies)
    for (const Body& body : object.sheet.bodies) {
      if (body.is_solid()) continue;
      const std::string seams = data::seam_warning(body_alone(object.sheet, body).rest);
      if (!seams.empty()) warnings.push_back((body.name.empty() ? object.name : body.name) + ": " + seams);
    }
  return warnings;
}

std::string collapse_warning(const SceneBody& in, int number, const Collapse& worst) {
  const Body& body = in.sheet.bodies[static_cast<std::size_t>(number)];
  const data::Constitutive law = in.environment.solids.at(number).constitutive;
  const bool rests_at_a_point = law == data::Constitutive::tet_neohookean;
  return (body.name.empty() ? in.name : body.name) + ": " + std::to_string(worst.elements) + " of " +
         std::to_string(body.tetrahedron_count) + " tetrahedra have less than " +
         data::format_short(collapsed_volume_share) + " of their rest volume at " +
         data::format_short(worst.time) + " s, and " +
         std::to_string(count_collapsed(in.sheet, body, in.environment.state.positions)) +
         " at the end: the solid is pressed farther than its law carries" +
         (rests_at_a_point ? "; TET_NEOHOOKEAN stays where it has come to a point" : "") +
         (law == data::Constitutive::tet_neohookean_log ? "" : "; take TET_NEOHOOKEAN_LOG") +
         ", or press it less (docs/theory.md, Solids)";
}

std::vector<std::string> coming_through_warnings(const std::vector<SceneBody>& bodies,
                                                 const std::vector<ComingThrough>& deepest) {
  std::vector<std::string> warnings;
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    if (deepest[b].obstacle < 0) continue;
    const SceneBody& body = bodies[b];
    const ComingThrough at_end = deepest_between_vertices(body.sheet, body.environment, told_coming_through);
    warnings.push_back(
        body.name + ": " + body.environment.obstacles[static_cast<std::size_t>(deepest[b].obstacle)].name +
        " comes through between its vertices by " + data::format_short(1e3 * deepest[b].depth) + " mm at " +
        data::format_short(deepest[b].time) + " s" +
        (at_end.obstacle == deepest[b].obstacle
             ? ", by " + data::format_short(1e3 * at_end.depth) + " mm at the end"
             : "") +
        ": contact is that of vertices; take smaller cells, or give a mesh a margin");
  }
  return warnings;
}

std::vector<std::string> keyframe_warnings(const data::Scene& scene, int steps) {
  const double end = (steps + 0.5) * scene.time_step;
  const auto late = std::count_if(scene.keyframe_times.begin(), scene.keyframe_times.end(),
                                  [&](double t) { return t > end; });
  if (late == 0) return {};
  return {"keyframes: " + std::to_string(late) + " of " + std::to_string(scene.keyframe_times.size()) +
          " lie after the end at " + data::format_short(steps * scene.time_step) +
          " s and are not written: is the duration right?"};
}

}  // namespace flash::sim
