#include "sysid/infer/solver_check.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>

#include "sysid/observe/motion_distance.h"
#include "sysid/replay/half_cell.h"

namespace flash::sysid {
namespace {

using Change = std::function<void(ReplaySettings&)>;

/// The same recording and sheet under other settings of the solver, keyframes weighing as they do.
Replay changed(const Replay& replay, const Change& change) {
  ReplaySettings settings = replay.settings;
  change(settings);
  Replay result = make_replay(replay.recording, settings, replay.plan);
  for (std::size_t k = 0; k < replay.observations.size(); ++k)
    result.observations[k].weight = replay.observations[k].weight;
  return result;
}

const std::vector<std::pair<std::string, Change>> kFinerSteps = {
    {"half_step", [](ReplaySettings& settings) { settings.solver.time_step *= 0.5; }},
    {"four_times_iterations", [](ReplaySettings& settings) {
       settings.solver.max_iterations *= 4;
       settings.solver.tolerance *= 0.1;
     }}};

std::vector<Replay> changed(const std::vector<Replay>& replays, const Change& change) {
  std::vector<Replay> result;
  for (const Replay& replay : replays) result.push_back(changed(replay, change));
  return result;
}

std::vector<Replay> on_half_the_cell(const std::vector<Replay>& replays) {
  std::vector<Replay> result;
  for (const Replay& replay : replays) {
    std::optional<Replay> finer = on_half_the_cell(replay);
    if (!finer) return {};
    result.push_back(std::move(*finer));
  }
  return result;
}

std::vector<ReplayResult> simulated(const std::vector<Replay>& replays, const ReplayCandidate& candidate,
                                    const MotionStore* store) {
  std::vector<ReplayResult> results;
  for (const Replay& replay : replays)
    results.push_back(store ? store->run(replay, candidate) : std::move(run(replay, {candidate}).front()));
  return results;
}

bool all_finite(const std::vector<ReplayResult>& results) {
  return std::all_of(results.begin(), results.end(),
                     [](const ReplayResult& result) { return result.finite; });
}

}  // namespace

Eigen::VectorXd ranges_of(const std::vector<Axis>& axes) {
  Eigen::VectorXd ranges(static_cast<Eigen::Index>(axes.size()));
  for (std::size_t k = 0; k < axes.size(); ++k) {
    const double low = axes[k].values.front(), high = axes[k].values.back();
    ranges[static_cast<Eigen::Index>(k)] = axes[k].logarithmic ? std::log(high / low) : high - low;
  }
  return ranges;
}

SolverCheck compare_solutions(const std::string& what, const Sensitivity& sensitivity,
                              const std::vector<Replay>& replays, const std::vector<ReplayResult>& motions,
                              const std::vector<Replay>& finer,
                              const std::vector<ReplayResult>& finer_motions, const GridSettings& grid) {
  SolverCheck found;
  found.what = what;
  double sum = 0;
  std::size_t count = 0;
  for (std::size_t r = 0; r < replays.size(); ++r)
    for (const auto& [t, distance] :
         motion_distance(replays[r], motions[r].motion, finer_motions[r].motion)) {
      sum += distance;
      ++count;
    }
  found.score = score_motions(finer, finer_motions, grid.score).score;
  found.surface_change_m = count > 0 ? sum / static_cast<double>(count) : 0;
  const Eigen::VectorXd shift =
      explain(sensitivity,
              displacements(sensitivity, finer, finer_motions) - displacements(sensitivity, replays, motions),
              ranges_of(grid.axes));
  for (std::size_t k = 0; k < grid.axes.size(); ++k)
    found.shift[grid.axes[k].name] = shift[static_cast<Eigen::Index>(k)];
  return found;
}

std::vector<SolverCheck> check_solver(const std::vector<Replay>& replays, const GridSettings& grid,
                                      const std::vector<double>& values) {
  const Sensitivity sensitivity = measure_sensitivity(replays, grid, values);
  if (!all_finite(sensitivity.motions)) return {};
  const ReplayCandidate candidate = candidate_at(values, grid);
  std::vector<SolverCheck> checks(1);
  checks[0].what = "estimate_itself";
  checks[0].score = score_motions(replays, sensitivity.motions, grid.score).score;
  for (const Axis& axis : grid.axes) checks[0].shift[axis.name] = 0;
  const auto add = [&](const std::string& what, const std::vector<Replay>& finer) {
    if (finer.empty()) return;
    const std::vector<ReplayResult> results = simulated(finer, candidate, nullptr);
    if (all_finite(results))
      checks.push_back(
          compare_solutions(what, sensitivity, replays, sensitivity.motions, finer, results, grid));
  };
  add(kFinerSteps[0].first, changed(replays, kFinerSteps[0].second));
  add("double_mesh", on_half_the_cell(replays));
  add(kFinerSteps[1].first, changed(replays, kFinerSteps[1].second));
  return checks;
}

std::vector<SolverCheck> check_steps(const std::vector<Replay>& replays, const Sensitivity& sensitivity,
                                     const GridSettings& grid, const std::vector<double>& values,
                                     const MotionStore& store) {
  const ReplayCandidate candidate = candidate_at(values, grid);
  const std::vector<ReplayResult> motions = simulated(replays, candidate, &store);
  std::vector<SolverCheck> checks;
  if (!all_finite(motions)) return checks;
  for (const auto& [what, change] : kFinerSteps) {
    const std::vector<Replay> finer = changed(replays, change);
    const std::vector<ReplayResult> results = simulated(finer, candidate, &store);
    if (all_finite(results))
      checks.push_back(compare_solutions(what, sensitivity, replays, motions, finer, results, grid));
  }
  return checks;
}

}  // namespace flash::sysid
