#pragma once
#include <functional>
#include <vector>

namespace flash::sim::cuda {

/// Teams of so many blocks each, which leave the device once no more than `leave_at` environments are
/// unfinished.
struct TeamStage {
  int blocks = 1, teams = 0, leave_at = 0;
};

/// Stages of a replay, one after the other, so that the last environments have all processors. A stage starts
/// where there are no more than two environments for each of its teams: a large team takes both in about the
/// time that two small ones take, and no slow environment is left to a small one at last.
/// `resident(blocks)`: teams of 1, 2, 4, ... up to `most_blocks` blocks that the device runs at once. Empty
/// where it runs none.
std::vector<TeamStage> team_stages(int environments, int most_blocks,
                                   const std::function<int(int)>& resident);

/// The one stage of a replay of so few steps that each environment is taken up once, those first that are
/// expected to take longest. It ends with the slowest environment or with the work of all, whichever is
/// later. Teams have the size with which that is earliest. No teams where the device runs none.
TeamStage one_turn_stage(int environments, int steps, int most_blocks,
                         const std::function<int(int)>& resident);

}  // namespace flash::sim::cuda
