#include "apps/sim/scene_observer.h"

#include <algorithm>

#include "data/files/text.h"
#include "data/numbers/worst.h"
#include "sim/scene/solid.h"

namespace flash::sim {

namespace {

constexpr double told_depth = 1e-4;  ///< of vertices inside an obstacle [m]

std::string place_of(const Deepest& deepest, const std::vector<SceneBody>& bodies) {
  const SceneBody& in = bodies[deepest.body];
  const Penetration& penetration = deepest.penetration;
  return in.name + ": vertex " + std::to_string(penetration.vertex) + " is " +
         data::format_short(1e3 * penetration.depth) + " mm inside " +
         in.environment.obstacles[static_cast<std::size_t>(penetration.obstacle)].name + " at " +
         data::format_short(deepest.time) + " s";
}

}  // namespace

void SceneObserver::see_collapse(const SceneBody& body, std::size_t b, double time, SceneSummary& summary) {
  for (const auto& [number, material] : body.environment.solids) {
    const int elements = count_collapsed(body.sheet, body.sheet.bodies[static_cast<std::size_t>(number)],
                                         body.environment.state.positions);
    Collapse& worst = collapses_[{b, number}];
    if (elements > worst.elements) worst = {elements, time};
    summary.collapsed_elements = std::max(summary.collapsed_elements, elements);
  }
}

void SceneObserver::see(const std::vector<SceneBody>& bodies, const std::vector<StepReport>& reports,
                        double time, double time_step, SceneSummary& summary) {
  bool converged = true, halved = false;
  inside_at_end_ = 0;
  for (std::size_t b = 0; b < reports.size(); ++b) {
    const StepReport& report = reports[b];
    const Environment& environment = bodies[b].environment;
    watches_[b].see(environment);
    const ComingThrough through = deepest_between_vertices(bodies[b].sheet, environment, told_coming_through);
    if (through.depth > deepest_[b].depth) deepest_[b] = through;
    see_collapse(bodies[b], b, time, summary);
    converged = converged && report.converged;
    halved = halved || report.substeps > 1;
    started_.see(report.start_penetration, b, time - time_step);
    inside_at_end_ = std::max(inside_at_end_, report.start_penetration.depth);
    if (report.held_penetration.depth > held_.penetration.depth)
      holder_ = holder_of(environment, report.held_penetration.vertex);
    held_.see(report.held_penetration, b, time);
    if (!report.converged) squeezed_.see(report.no_room, b, time);
    summary.residual_max = data::worst(summary.residual_max, report.residual);
    summary.penetration_max = data::worst(summary.penetration_max, report.penetration_max);
    summary.complementarity_max = data::worst(summary.complementarity_max, report.complementarity);
    summary.iterations += report.iterations;
    summary.layer_touches_max = std::max(summary.layer_touches_max, report.layer_touches);
    nearest_ = std::min(nearest_, report.layer_distance);
  }
  summary.unconverged_steps += !converged;
  summary.halved_steps += halved;
  if (nearest_ < no_layers) summary.layer_distance_min = nearest_;
  summary.held_penetration_max = held_.penetration.depth;
  summary.start_penetration_max = started_.penetration.depth;
}

void SceneObserver::conclude(const data::Scene& scene, const std::vector<SceneBody>& bodies,
                             SceneSummary& summary) const {
  std::vector<std::string>& warnings = summary.warnings;
  const auto add = [&](const std::vector<std::string>& more) {
    warnings.insert(warnings.end(), more.begin(), more.end());
  };
  add(seam_warnings(bodies));
  add(stiff_mesh_warnings(bodies));
  for (const auto& [solid, worst] : collapses_)
    if (worst.elements > 0) warnings.push_back(collapse_warning(bodies[solid.first], solid.second, worst));
  for (std::size_t b = 0; b < bodies.size() && !summary.interrupted && summary.steps > 0; ++b)
    for (const std::string& warning : hold_warnings(watches_[b], bodies[b].environment))
      warnings.push_back(bodies[b].name + ": " + warning);
  add(coming_through_warnings(bodies, deepest_));
  if (!scene.rest_motion && !summary.interrupted) add(keyframe_warnings(scene, summary.steps));
  if (held_.penetration.depth > told_depth)
    warnings.push_back(place_of(held_, bodies) + ", where " + holder_ +
                       " holds it: is the height of the obstacle right, or the path?");
  if (squeezed_.penetration.depth > 0)
    warnings.push_back(place_of(squeezed_, bodies) +
                       ": obstacles leave it no room, and such steps are not solved; leave room where "
                       "obstacles close");
  if (started_.penetration.depth > told_depth)
    warnings.push_back(place_of(started_, bodies) + ", where a step starts: the obstacle lets it out at " +
                       data::format_short(scene.solver.exit_speed) + " m/s" +
                       (inside_at_end_ > told_depth
                            ? "; at the end it is still inside, by " +
                                  data::format_short(1e3 * inside_at_end_) +
                                  " mm: the run is too short, or its way out would tear it"
                            : "") +
                       "; start outside, and leave room where obstacles close");
}

}  // namespace flash::sim
