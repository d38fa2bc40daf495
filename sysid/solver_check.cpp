#include "sysid/solver_check.h"

#include <algorithm>
#include <functional>

#include "data/procedural_mesh.h"
#include "data/text.h"
#include "sysid/surface_change.h"

namespace flash::sysid {
namespace {

// "sheet:0.4x0.4:0.02[:pattern]" with half the cell; empty for anything else.
std::string finer_mesh(const std::string& specification) {
  if (!data::is_mesh_spec(specification)) return "";
  const std::vector<std::string_view> words = data::split(specification, ":");
  const auto cell = words.size() >= 3 ? data::parse_number(words[2]) : std::nullopt;
  if (!cell || words[0] != "sheet") return "";
  std::string finer =
      std::string(words[0]) + ":" + std::string(words[1]) + ":" + data::format_number(0.5 * *cell);
  for (std::size_t k = 3; k < words.size(); ++k) finer += ":" + std::string(words[k]);
  return finer;
}

using Change = std::function<bool(const data::Recording&, ReplaySettings&)>;

std::optional<SolverCheck> check(const std::string& what, const Change& change,
                                 const std::vector<Replay>& replays,
                                 const std::vector<ReplayResult>& reference, const ReplayCandidate& candidate,
                                 const ScoreSettings& score) {
  std::vector<Replay> finer;
  std::vector<ReplayResult> results;
  SolverCheck found{what, 0, 0};
  double sum = 0;
  std::size_t count = 0;
  for (std::size_t r = 0; r < replays.size(); ++r) {
    ReplaySettings settings = replays[r].settings;
    if (!change(replays[r].recording, settings)) return std::nullopt;
    finer.push_back(make_replay(replays[r].recording, settings));
    finer.back().observations = replays[r].observations;
    results.push_back(std::move(run(finer.back(), {candidate}).front()));
    for (const auto& [t, distance] : surface_change(replays[r], reference[r].motion, results[r].motion)) {
      sum += distance;
      ++count;
    }
  }
  found.score = score_motions(finer, results, score).score;
  found.surface_change_m = count > 0 ? sum / static_cast<double>(count) : 0;
  return found;
}

}  // namespace

std::vector<SolverCheck> check_solver(const std::vector<Replay>& replays, const ReplayCandidate& candidate,
                                      const ScoreSettings& score) {
  std::vector<ReplayResult> reference;
  for (const Replay& replay : replays) reference.push_back(std::move(run(replay, {candidate}).front()));
  const std::vector<std::pair<std::string, Change>> changes = {
      {"half_step",
       [](const data::Recording&, ReplaySettings& settings) {
         settings.solver.time_step *= 0.5;
         return true;
       }},
      {"double_mesh",
       [](const data::Recording& recording, ReplaySettings& settings) {
         settings.mesh = finer_mesh(recording.mesh_spec);
         const bool by_index = std::any_of(recording.grasps.begin(), recording.grasps.end(),
                                           [](const auto& grasp) { return !grasp.select.vertices.empty(); });
         return !settings.mesh.empty() && recording.start_mesh.empty() && !by_index;
       }},
      {"four_times_iterations", [](const data::Recording&, ReplaySettings& settings) {
         settings.solver.max_iterations *= 4;
         settings.solver.tolerance *= 0.1;
         return true;
       }}};
  std::vector<SolverCheck> checks;
  for (const auto& [what, change] : changes)
    if (const auto found = check(what, change, replays, reference, candidate, score))
      checks.push_back(*found);
  return checks;
}

}  // namespace flash::sysid
