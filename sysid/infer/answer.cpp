#include "sysid/infer/answer.h"

#include <algorithm>
#include <cmath>

#include "sysid/infer/refine.h"
#include "sysid/observe/horizon.h"

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

Answer find_answer(GridResults& results, std::vector<Replay>& replays, const GridSettings& grid,
                   const AnswerSettings& settings, const TellWork& told) {
  Answer answer;
  GridVerdict& verdict = answer.verdict;
  std::vector<SolverCheck>& checks = answer.checks;
  answer.horizons.resize(replays.size());
  verdict = profile_grid(results, settings.repeatability);
  if (verdict.best < 0) return answer;

  const auto values = [&] {
    return std::vector<double>(verdict.estimate.data(), verdict.estimate.data() + verdict.estimate.size());
  };
  if (settings.horizon) {
    const ReplayCandidate best = candidate_at(values(), grid);
    for (std::size_t r = 0; r < replays.size(); ++r)
      answer.horizons[r] = predictability_horizon(replays[r], best);
    drop_beyond_horizons(answer.horizons, results);
    for (std::size_t r = 0; r < replays.size(); ++r) drop_beyond_horizon(answer.horizons[r], replays[r]);
    verdict = profile_grid(results, settings.repeatability);
  }
  SolverError error;
  std::optional<Refined> refined;
  if (!grid.rollouts.empty())
    refined = refine(results, verdict, replays, grid, settings.repeatability, settings.solver_check, told);
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
  answer.interpolation = error.interpolation;
  return answer;
}

}  // namespace flash::sysid
