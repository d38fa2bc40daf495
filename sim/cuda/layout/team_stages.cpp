#include "sim/cuda/layout/team_stages.h"

#include <algorithm>

namespace flash::sim::cuda {

std::vector<TeamStage> team_stages(int environments, int turns, int most_blocks,
                                   const std::function<int(int)>& resident) {
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

}  // namespace flash::sim::cuda
