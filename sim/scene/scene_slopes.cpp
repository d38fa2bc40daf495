#include "sim/scene/scene_slopes.h"

#include <algorithm>
#include <map>

#include "data/files/error.h"
#include "data/files/text.h"
#include "sim/scene/slopes.h"

namespace flash::sim {
namespace {

/// What each hold takes in the first step; none: it does not act there.
std::vector<HeldVertices> held_at_start(const data::Scene& scene, const Environment& environment) {
  Environment first = environment;
  try {
    update_holds(first, scene.time_step);
  } catch (const data::InputError& error) {
    throw data::InputError(scene.source + ": " + error.what());
  }
  return first.state.held;
}

/// Of those that act in the first step: whether a hold does so in the last one.
bool acts_to_the_end(const data::Scene& scene, int steps, const Hold& hold) {
  return hold.to > (steps - 0.5) * scene.time_step;
}

void check_patch(const data::Scene& scene, const SlopeWish& wish, const Sheet& sheet,
                 const std::vector<int>& held) {
  std::vector<bool> inside(static_cast<std::size_t>(sheet.rest.vertices.rows()), false);
  for (const int vertex : held) inside[static_cast<std::size_t>(vertex)] = true;
  for (const RestTriangle& triangle : sheet.triangles)
    if (triangle.stiff && std::any_of(triangle.vertices.begin(), triangle.vertices.end(),
                                      [&](int vertex) { return inside[static_cast<std::size_t>(vertex)]; }))
      return;
  throw data::input_error(scene.source, wish.field + ".slopes",
                          "found no triangle of which it holds all vertices, expected a patch a cell wide at "
                          "least: a row of vertices has no slope");
}

/// Where the holds bring the vertices of a patch; of all others where they start.
data::Points places_of(const Environment& environment, const std::vector<HeldVertices>& held) {
  data::Points places = environment.state.positions;
  for (std::size_t k = 0; k < held.size(); ++k)
    if (const Hold& hold = environment.holds[k]; hold.frame == base_frame && hold.targets.rows() > 0)
      places(held[k].vertices, Eigen::all) = hold.targets;
  return places;
}

}  // namespace

void keep_scene_slopes(const data::Scene& scene, int steps, const std::vector<SlopeWish>& wishes,
                       SceneBody& body, std::vector<std::string>& notices) {
  const Environment& environment = body.environment;
  const bool any = std::any_of(wishes.begin(), wishes.end(), [](const auto& wish) { return wish.slopes; });
  if (wishes.empty() || (has_solids(body.sheet) && !any)) return;
  const std::vector<HeldVertices> held = held_at_start(scene, environment);
  // By frame: holds of one frame carry their vertices as one.
  std::map<int, std::vector<int>> keeping, all;
  for (std::size_t k = 0; k < wishes.size(); ++k) {
    const Hold& hold = environment.holds[k];
    const auto refuse = [&](const std::string& why) {
      throw data::input_error(scene.source, wishes[k].field + ".slopes", why);
    };
    if (hold.axes != std::array{true, true, true} || hold.at_origin) continue;
    const std::vector<int>& vertices = held[k].vertices;
    std::vector<int>& together = all[hold.frame];
    together.insert(together.end(), vertices.begin(), vertices.end());
    if (!wishes[k].slopes) continue;
    if (has_solids(body.sheet))
      refuse("found true, expected false for " + body.name + ", a solid, which has no slopes of its own");
    // Stiff triangles are part of the plan: of the whole run.
    if (vertices.empty() || !acts_to_the_end(scene, steps, hold))
      refuse("found a hold from " + data::format_short(std::max(0.0, hold.from)) + " s to " +
             data::format_short(std::min(hold.to, steps * scene.time_step)) +
             " s, expected one that acts in every step, to " + data::format_short(steps * scene.time_step) +
             " s");
    keeping[hold.frame].insert(keeping[hold.frame].end(), vertices.begin(), vertices.end());
  }
  for (const auto& [frame, vertices] : keeping) keep_slopes(vertices, body.sheet);
  for (std::size_t k = 0; k < wishes.size(); ++k)
    if (wishes[k].slopes) check_patch(scene, wishes[k], body.sheet, held[k].vertices);
  if (has_solids(body.sheet)) return;

  const data::SheetMaterial& material = environment.materials[0];
  constexpr double flat = 1e-3;  // [rad]; the slope at the border is off by at most that
  if (any && material.bending_model == data::BendingModel::plate)
    if (const double bend = bend_between_stiff(body.sheet, places_of(environment, held)); bend > flat)
      throw data::input_error(
          scene.source, "objects." + body.name,
          "found a bend of " + data::format_short(180 / EIGEN_PI * bend) +
              " degrees within what holds with slopes carry, expected a flat patch, or bending_model hinge");
  const auto gives_way = [&](const auto& patch) { return slope_gives_way(body.sheet, patch.second); };
  if (material.bending_rigidity > 0 && std::any_of(all.begin(), all.end(), gives_way))
    notices.push_back(body.name +
                      ": its holds keep places, not slopes: a strip clamped so bends as if it were half a "
                      "cell longer, 25 % too soft with 10 cells along it, 5.9 % with 40; \"slopes\": true "
                      "keeps them");
}

}  // namespace flash::sim
