#include "sysid/judge.h"

#include <algorithm>
#include <cmath>

#include "data/text.h"
#include "sysid/predictability.h"
#include "sysid/profile.h"
#include "sysid/refine.h"
#include "sysid/sensitivity.h"
#include "sysid/solver_check.h"
#include "sysid/summarize.h"

namespace flash::sysid {

namespace {

/// The interpolation promised less than what was simulated at its minimum: the best candidate stands.
void fall_back_on_best(const GridResults& results, GridVerdict& verdict) {
  const std::vector<double>& best = results.candidates[static_cast<std::size_t>(verdict.best)].values;
  for (std::size_t k = 0; k < best.size(); ++k) {
    verdict.estimate[static_cast<Eigen::Index>(k)] = best[k];
    verdict.parameters[k].estimate = best[k];
  }
}

}  // namespace

Summary judge(GridResults& results, std::vector<Replay>& replays, const GridSettings& grid,
              const JudgeSettings& settings) {
  GridVerdict verdict = profile_grid(results, settings.repeatability);
  if (verdict.best < 0) return summarize(results, verdict, replays, grid);

  const auto values = [&] {
    return std::vector<double>(verdict.estimate.data(), verdict.estimate.data() + verdict.estimate.size());
  };
  std::vector<std::optional<double>> horizons(replays.size());
  if (settings.horizon) {
    const ReplayCandidate best = candidate_at(values(), grid);
    for (std::size_t r = 0; r < replays.size(); ++r) horizons[r] = predictability_horizon(replays[r], best);
    drop_beyond_horizons(horizons, results);
    for (std::size_t r = 0; r < replays.size(); ++r) drop_beyond_horizon(horizons[r], replays[r]);
    verdict = profile_grid(results, settings.repeatability);
  }
  std::vector<SolverCheck> checks;
  SolverError error;
  std::optional<Refined> refined;
  if (!grid.rollouts.empty())
    refined = refine(results, verdict, replays, grid, settings.repeatability, settings.solver_check);
  if (refined) {
    verdict = refined->verdict;
    checks = std::move(refined->checks);
    error.interpolation = refined->interpolation;
  } else if (settings.solver_check) {
    checks = check_solver(replays, grid, values());
    if (!checks.empty()) error.interpolation = std::abs(checks.front().score - verdict.estimate_score);
    for (const SolverCheck& check : checks) {
      error.score = std::max(error.score, std::hypot(verdict.score, check.surface_change_m) - verdict.score);
      SolverShift& shift = error.shifts.emplace_back(static_cast<Eigen::Index>(grid.axes.size()));
      for (std::size_t k = 0; k < grid.axes.size(); ++k)
        shift[static_cast<Eigen::Index>(k)] = check.shift.at(grid.axes[k].name);
    }
    verdict = profile_grid(results, settings.repeatability, error);
    if (!checks.empty() && checks.front().score > verdict.score) fall_back_on_best(results, verdict);
  } else {
    // Nothing was simulated at the estimate: where the interpolation lies below every simulated score, that
    // is not known to be more than its own error.
    error.interpolation = verdict.score - verdict.estimate_score;
    verdict = profile_grid(results, settings.repeatability, error);
  }
  Summary summary = summarize(results, verdict, replays, grid);
  summary.solver_check = std::move(checks);
  summary.settings["solver_check"] = settings.solver_check ? "yes" : "no";
  summary.settings["horizon"] = settings.horizon ? "yes" : "no";
  constexpr double kCoarse = 0.05;  // of the score
  if (error.interpolation > kCoarse * verdict.score)
    summary.warnings.push_back("between the values of the grid the score is known to " +
                               data::format_short(1000 * error.interpolation) +
                               " mm only, which widens the intervals: search more values or narrower ranges");
  for (std::size_t r = 0; r < replays.size(); ++r) summary.recordings[r].horizon_s = horizons[r];
  return summary;
}

}  // namespace flash::sysid
