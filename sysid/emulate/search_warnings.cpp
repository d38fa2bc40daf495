#include "sysid/emulate/search_warnings.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "data/files/text.h"
#include "sysid/replay/coarse_cells.h"
#include "sysid/replay/grasp_mesh.h"
#include "sysid/replay/half_cell.h"
#include "sysid/replay/recorded_grasp.h"

namespace flash::sysid {
namespace {

std::string mm(double length) { return data::format_short(std::round(1e5 * length) / 100) + " mm"; }

Eigen::Vector2d sides_of(const Replay& replay) {
  return (replay.recording.mesh.vertices.colwise().maxCoeff() -
          replay.recording.mesh.vertices.colwise().minCoeff())
      .head<2>()
      .transpose();
}

/// Of a patch at a corner against the one that was stated; empty where they agree.
std::string corner_warning(const Replay& replay, const data::RecordedGrasp& grasp) {
  // Of the patch: cells that hold another size are warned of. Chosen: not varied.
  constexpr double kSame = 0.1;
  const double within = size_of_patch(grasp, replay.settings),
               stated = sides_of(replay).cwiseMin(within).norm(), held = held_extent(replay, grasp);
  if (std::abs(held - stated) <= kSame * stated) return "";
  return replay.recording.name + ": the cells hold " + mm(held) +
         " of the sheet from corner to corner of the patch, where " + mm(stated) +
         " are stated: leave the pattern of --mesh and --grasp-cell out, or choose cells that divide the "
         "patch "
         "(--mesh, --grasp-within)";
}

/// Of the values searched, those that bend most and least under their weight.
ReplayCandidate extreme_candidate(const GridSettings& settings, bool limpest) {
  std::vector<double> values;
  for (const Axis& axis : settings.axes) {
    const auto [least, most] = std::minmax_element(axis.values.begin(), axis.values.end());
    values.push_back((axis.name == "areal_density") == limpest ? *most : *least);
  }
  return candidate_at(values, settings);
}

/// Of the fold, where half the cells are coarse too. Work: follows from most_of_fold.
constexpr double most_on_halves = 2 * most_of_fold;

/// Whether cells that are coarse for the fold are halved for what comes.
bool are_halved(const Replay& replay, Coming coming) {
  return coming == Coming::answer && !replay.settings.self_contact;
}

/// Of candidates from the limpest on; empty where they bend in folds that the cells resolve.
std::string coarse_text(const Replay& replay, const ReplayCandidate& limpest, Coming coming) {
  const bool halved = are_halved(replay, coming);
  const double bending = limpest.material.bending_rigidity,
               first = coarse_below(replay, limpest, halved ? most_of_fold_of_answer : most_of_fold),
               last = coarse_below(replay, limpest, halved ? most_on_halves : most_of_fold);
  if (!(bending < first)) return "";
  const auto below = [](double rigidity) { return "below " + data::format_short(rigidity) + " N m"; };
  std::string text = replay.recording.name + ": cells of " + mm(typical_cell(replay.recording.mesh)) +
                     " are coarse for the fold in which the sheet leaves the table where bending is " +
                     below(first) + ", and " + data::format_short(bending) + " N m is " +
                     (coming == Coming::estimate ? "the estimate" : "searched");
  if (halved) text += ": an answer there is simulated on smaller cells, down to half of these";
  if (bending < last)
    text += (halved ? ". Bending " + below(last) + ": it" : ": there it") +
            " may be off by a few percent more than is said of it";
  return text;
}

}  // namespace

ReplayCandidate limpest_candidate(const GridSettings& settings) { return extreme_candidate(settings, true); }

std::vector<std::string> warnings_of_grasps(const std::vector<Replay>& replays) {
  // Of the smaller extent of the sheet: halves that hold another size are warned of. Chosen: not varied.
  constexpr double kSame = 0.01;
  std::vector<std::string> warnings;
  for (const Replay& replay : replays) {
    if (replay.recording.is_solid()) continue;
    std::optional<Replay> finer;
    for (std::size_t g = 0; g < replay.recording.grasps.size(); ++g) {
      const data::RecordedGrasp& grasp = replay.recording.grasps[g];
      if (shape_of(grasp, replay.settings) == data::GraspShape::point) continue;
      if (grasp.select.corner) {
        if (const std::string text = corner_warning(replay, grasp); !text.empty()) warnings.push_back(text);
        continue;
      }
      if (!finer) finer = on_half_the_cell(replay);
      const double here = held_extent(replay, grasp), there = held_extent(*finer, finer->recording.grasps[g]);
      if (std::abs(here - there) > kSame * sides_of(replay).minCoeff())
        warnings.push_back(replay.recording.name + ": the gripper holds " + mm(here) +
                           " of the sheet on the mesh of the search, and " + mm(there) +
                           " on half its cells: choose cells that divide the patch (--mesh, --grasp-within)");
    }
  }
  return warnings;
}

KnownBefore known_before(const std::vector<Replay>& replays, const GridSettings& settings, Coming coming) {
  KnownBefore known{warnings_of_grasps(replays), {}};
  if (settings.base.solid) return known;
  const ReplayCandidate limpest = limpest_candidate(settings), stiffest = extreme_candidate(settings, false);
  for (const Replay& replay : replays) {
    const std::string text = coarse_text(replay, limpest, coming);
    if (text.empty()) continue;
    const double last = are_halved(replay, coming) ? most_on_halves : most_of_fold;
    const bool all = stiffest.material.bending_rigidity < coarse_below(replay, stiffest, last);
    (all ? known.warnings : known.notices).push_back(text);
  }
  return known;
}

GridSettings held_at(const std::vector<double>& values, GridSettings settings) {
  for (std::size_t k = 0; k < settings.axes.size(); ++k) settings.axes[k].values = {values[k]};
  return settings;
}

}  // namespace flash::sysid
