#include <atomic>
#include <thread>

#include "sim/solver.h"

namespace flash::sim {

std::vector<Rollout> simulate(const Sheet& sheet, std::vector<Environment> environments, int steps,
                              const SolverSettings& settings, int threads) {
  const auto plan = make_sheet_plan(sheet);
  std::vector<Rollout> rollouts(environments.size());
  std::atomic<size_t> next = 0;
  const auto work = [&] {
    for (size_t e = next++; e < environments.size(); e = next++) {
      Solver solver(plan, settings);
      Rollout& rollout = rollouts[e];
      rollout.positions.push_back(environments[e].state.positions);
      for (int k = 0; k < steps; ++k) {
        rollout.reports.push_back(solver.step(environments[e]));
        rollout.positions.push_back(environments[e].state.positions);
      }
    }
  };
  std::vector<std::thread> workers;
  for (int t = 1; t < threads; ++t) workers.emplace_back(work);
  work();
  for (std::thread& worker : workers) worker.join();
  return rollouts;
}

}  // namespace flash::sim
