#include "sim/cuda/layout/team_stages.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace flash::sim::cuda {

std::vector<TeamStage> team_stages(int environments, int most_blocks,
                                   const std::function<int(int)>& resident) {
  constexpr int turns = 2;
  std::vector<TeamStage> stages;
  int leave_at = 0;
  for (int blocks = most_blocks; blocks >= 1 && leave_at < environments; blocks /= 2) {
    const int teams = resident(blocks);
    if (teams == 0) continue;
    stages.push_back({blocks, std::min(teams, environments), leave_at});
    leave_at = turns * teams;
  }
  std::reverse(stages.begin(), stages.end());
  return stages;
}

TeamStage one_turn_stage(int environments, int steps, int most_blocks,
                         const std::function<int(int)>& resident) {
  // On an H200, 1,024 vertices: a step takes 2.1 ms on one processor, 1.0 on eight. The slowest of 64
  // environments takes five times the mean of one step, twice that of ten.
  constexpr double gain_of_blocks = 1.0 / 3;
  const double slowest = 1 + 4 / std::sqrt(static_cast<double>(steps));
  TeamStage best;
  double least = std::numeric_limits<double>::infinity();
  for (int blocks = most_blocks; blocks >= 1; blocks /= 2) {
    const int teams = std::min(resident(blocks), environments);
    if (teams == 0) continue;
    const double rounds = std::max(slowest, static_cast<double>(environments) / teams),
                 time = rounds * std::pow(blocks, -gain_of_blocks);
    if (time >= least) continue;
    least = time;
    best = {blocks, teams, 0};
  }
  return best;
}

}  // namespace flash::sim::cuda
