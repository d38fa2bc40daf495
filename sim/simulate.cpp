#include "data/error.h"
#include "data/parallel.h"
#include "sim/solver.h"

namespace flash::sim {

std::vector<Rollout> simulate(const Sheet& sheet, std::vector<Environment> environments, int steps,
                              const SolverSettings& settings, int threads) {
  const auto plan = make_sheet_plan(sheet);
  std::vector<Rollout> rollouts(environments.size());
  data::for_each_in_parallel(environments.size(), std::max(1, threads), [&](std::size_t e) {
    Solver solver(plan, settings);
    Rollout& rollout = rollouts[e];
    rollout.positions.push_back(environments[e].state.positions);
    for (int k = 0; k < steps; ++k) {
      if (settings.stop != nullptr && *settings.stop) throw data::Stopped();
      rollout.reports.push_back(solver.step(environments[e]));
      rollout.positions.push_back(environments[e].state.positions);
    }
  });
  return rollouts;
}

}  // namespace flash::sim
