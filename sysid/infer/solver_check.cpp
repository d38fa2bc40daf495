#include "sysid/infer/solver_check.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "sysid/observe/motion_distance.h"

namespace flash::sysid {
namespace {

using Change = std::function<void(ReplaySettings&)>;

/// The same recording and sheet under other settings of the solver, keyframes weighing as they do.
Replay changed(const Replay& replay, const Change& change) {
  ReplaySettings settings = replay.settings;
  change(settings);
  return make_replay(replay, settings, replay.plan);
}

std::vector<Replay> changed(const std::vector<Replay>& replays, const Change& change) {
  std::vector<Replay> result;
  for (const Replay& replay : replays) result.push_back(changed(replay, change));
  return result;
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

std::map<std::string, double> shift_between(const Sensitivity& sensitivity,
                                            const std::vector<Replay>& replays,
                                            const std::vector<ReplayResult>& motions,
                                            const std::vector<Replay>& finer,
                                            const std::vector<ReplayResult>& finer_motions,
                                            const std::vector<Axis>& axes) {
  const Eigen::VectorXd shift =
      explain(sensitivity,
              displacements(sensitivity, finer, finer_motions) - displacements(sensitivity, replays, motions),
              ranges_of(axes));
  std::map<std::string, double> named;
  for (std::size_t k = 0; k < axes.size(); ++k) named[axes[k].name] = shift[static_cast<Eigen::Index>(k)];
  return named;
}

double mean_motion_distance(const std::vector<Replay>& replays, const std::vector<ReplayResult>& motions,
                            const std::vector<ReplayResult>& others) {
  double sum = 0;
  std::size_t count = 0;
  for (std::size_t r = 0; r < replays.size(); ++r)
    for (const auto& [t, distance] : motion_distance(replays[r], motions[r].motion, others[r].motion)) {
      sum += distance;
      ++count;
    }
  return count > 0 ? sum / static_cast<double>(count) : 0;
}

SolverCheck compare_solutions(const std::string& what, const Sensitivity& sensitivity,
                              const std::vector<Replay>& replays, const std::vector<ReplayResult>& motions,
                              const std::vector<Replay>& finer,
                              const std::vector<ReplayResult>& finer_motions, const std::vector<Axis>& axes) {
  SolverCheck found;
  found.what = what;
  found.surface_change_m = mean_motion_distance(replays, motions, finer_motions);
  found.shift = shift_between(sensitivity, replays, motions, finer, finer_motions, axes);
  return found;
}

std::vector<Replay> with_step(const std::vector<Replay>& replays, double share) {
  return changed(replays, [&](ReplaySettings& settings) { settings.solver.time_step *= share; });
}

std::vector<FinerSettings> finer_settings(const std::vector<Replay>& replays) {
  return {{"half_step", with_step(replays, 0.5)},
          {"four_times_iterations", changed(replays, [](ReplaySettings& settings) {
             settings.solver.max_iterations *= 4;
             settings.solver.tolerance *= 0.1;
           })}};
}

std::vector<FinerSolution> finer_solutions(std::vector<FinerSettings> settings,
                                           const ReplayCandidate& candidate, const MotionStore& store) {
  std::vector<WantedMotion> wanted;
  for (const FinerSettings& finer : settings)
    for (const Replay& replay : finer.replays) wanted.push_back({&replay, candidate});
  store.prepare(wanted);
  std::vector<FinerSolution> solutions;
  for (FinerSettings& finer : settings) {
    FinerSolution solution{finer.what, std::move(finer.replays), {}};
    for (const Replay& replay : solution.replays) solution.motions.push_back(store.run(replay, candidate));
    if (all_finite(solution.motions)) solutions.push_back(std::move(solution));
  }
  return solutions;
}

}  // namespace flash::sysid
