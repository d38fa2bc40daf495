#include "sysid/judge.h"

#include <algorithm>
#include <cmath>

#include "sysid/predictability.h"
#include "sysid/profile.h"
#include "sysid/solver_check.h"
#include "sysid/summarize.h"

namespace flash::sysid {

Summary judge(GridResults& results, std::vector<Replay>& replays, const GridSettings& grid,
              const JudgeSettings& settings) {
  GridVerdict verdict = profile_grid(results, settings.repeatability);
  if (verdict.best < 0) return summarize(results, verdict, replays, grid);

  std::vector<std::optional<double>> horizons(replays.size());
  if (settings.horizon) {
    const ReplayCandidate best =
        candidate_of(results.candidates[static_cast<std::size_t>(verdict.best)], grid);
    for (std::size_t r = 0; r < replays.size(); ++r) horizons[r] = predictability_horizon(replays[r], best);
    drop_beyond_horizons(horizons, results);
    for (std::size_t r = 0; r < replays.size(); ++r) drop_beyond_horizon(horizons[r], replays[r]);
    verdict = profile_grid(results, settings.repeatability);
  }
  std::vector<SolverCheck> checks;
  if (settings.solver_check) {
    const CandidateResult& best = results.candidates[static_cast<std::size_t>(verdict.best)];
    checks = check_solver(replays, candidate_of(best, grid), grid.score);
    double score_error = 0;
    for (const SolverCheck& check : checks)
      if (std::isfinite(check.score)) score_error = std::max(score_error, std::abs(check.score - best.score));
    verdict = profile_grid(results, settings.repeatability, score_error);
  }
  Summary summary = summarize(results, verdict, replays, grid);
  summary.solver_check = std::move(checks);
  for (std::size_t r = 0; r < replays.size(); ++r) summary.recordings[r].horizon_s = horizons[r];
  return summary;
}

}  // namespace flash::sysid
