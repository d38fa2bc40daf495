#include "sysid/solver_check.h"

#include <cmath>
#include <functional>
#include <optional>

#include "data/procedural_mesh.h"
#include "data/text.h"
#include "sysid/sensitivity.h"
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

/// Of each axis, in the units of Sensitivity.
Eigen::VectorXd ranges_of(const std::vector<Axis>& axes) {
  Eigen::VectorXd ranges(static_cast<Eigen::Index>(axes.size()));
  for (std::size_t k = 0; k < axes.size(); ++k) {
    const double low = axes[k].values.front(), high = axes[k].values.back();
    ranges[static_cast<Eigen::Index>(k)] = axes[k].logarithmic ? std::log(high / low) : high - low;
  }
  return ranges;
}

std::optional<SolverCheck> check(const std::string& what, const Change& change,
                                 const std::vector<Replay>& replays, const Sensitivity& sensitivity,
                                 const GridSettings& grid, const ReplayCandidate& candidate) {
  std::vector<Replay> finer;
  std::vector<ReplayResult> results;
  SolverCheck found;
  found.what = what;
  double sum = 0;
  std::size_t count = 0;
  for (std::size_t r = 0; r < replays.size(); ++r) {
    ReplaySettings settings = replays[r].settings;
    if (!change(replays[r].recording, settings)) return std::nullopt;
    finer.push_back(make_replay(replays[r].recording, settings));
    for (std::size_t k = 0; k < replays[r].observations.size(); ++k)
      finer.back().observations[k].weight = replays[r].observations[k].weight;
    results.push_back(std::move(run(finer.back(), {candidate}).front()));
    if (!results.back().finite) return std::nullopt;
    for (const auto& [t, distance] :
         surface_change(replays[r], sensitivity.motions[r].motion, results[r].motion)) {
      sum += distance;
      ++count;
    }
  }
  found.score = score_motions(finer, results, grid.score).score;
  found.surface_change_m = count > 0 ? sum / static_cast<double>(count) : 0;
  const Eigen::VectorXd shift =
      explain(sensitivity, displacements(sensitivity, finer, results), ranges_of(grid.axes));
  for (std::size_t k = 0; k < grid.axes.size(); ++k)
    found.shift[grid.axes[k].name] = shift[static_cast<Eigen::Index>(k)];
  return found;
}

}  // namespace

std::vector<SolverCheck> check_solver(const std::vector<Replay>& replays, const GridSettings& grid,
                                      const std::vector<double>& values) {
  const Sensitivity sensitivity = measure_sensitivity(replays, grid, values);
  for (const ReplayResult& result : sensitivity.motions)
    if (!result.finite) return {};
  const ReplayCandidate candidate = candidate_at(values, grid);
  const std::vector<std::pair<std::string, Change>> changes = {
      {"half_step",
       [](const data::Recording&, ReplaySettings& settings) {
         settings.solver.time_step *= 0.5;
         return true;
       }},
      {"double_mesh",
       [](const data::Recording& recording, ReplaySettings& settings) {
         settings.mesh = finer_mesh(recording.mesh_spec);
         return !settings.mesh.empty() && recording.start_mesh.empty();
       }},
      {"four_times_iterations", [](const data::Recording&, ReplaySettings& settings) {
         settings.solver.max_iterations *= 4;
         settings.solver.tolerance *= 0.1;
         return true;
       }}};
  std::vector<SolverCheck> checks(1);
  checks[0].what = "estimate_itself";
  checks[0].score = score_motions(replays, sensitivity.motions, grid.score).score;
  for (const Axis& axis : grid.axes) checks[0].shift[axis.name] = 0;
  for (const auto& [what, change] : changes)
    if (const auto found = check(what, change, replays, sensitivity, grid, candidate))
      checks.push_back(*found);
  return checks;
}

}  // namespace flash::sysid
