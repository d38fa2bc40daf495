#include "sim/cuda/layout/team_stages.h"

#include <gtest/gtest.h>

namespace flash::sim::cuda {
namespace {

/// Of a card with 132 processors in groups of 16 or 18.
int resident(int blocks) { return blocks == 1 ? 132 : blocks == 2 ? 66 : blocks == 4 ? 30 : 15; }

TEST(TeamStages, FewEnvironmentsHaveTheLargestTeams) {
  for (const int environments : {1, 15, 30}) {
    const auto stages = team_stages(environments, 8, resident);
    ASSERT_EQ(stages.size(), 1u);
    EXPECT_EQ(stages[0].blocks, 8);
    EXPECT_EQ(stages[0].teams, std::min(environments, 15));
    EXPECT_EQ(stages[0].leave_at, 0);
  }
}

TEST(TeamStages, LeaveToLargerOnesWhatThoseCanTakeInTwoTurns) {
  for (const int environments : {16, 64, 133, 1024}) {
    const auto stages = team_stages(environments, 8, resident);
    ASSERT_FALSE(stages.empty());
    EXPECT_LT(stages.front().leave_at, environments);
    EXPECT_EQ(stages.back().blocks, 8);
    EXPECT_EQ(stages.back().leave_at, 0);
    for (std::size_t k = 0; k + 1 < stages.size(); ++k) {
      EXPECT_EQ(stages[k + 1].blocks, 2 * stages[k].blocks);
      EXPECT_EQ(stages[k].leave_at, 2 * resident(stages[k + 1].blocks));
    }
    // No larger teams would do to start with.
    if (stages.front().blocks > 1) {
      EXPECT_LE(environments, 2 * resident(stages.front().blocks));
    }
  }
}

TEST(TeamStages, OfOneTurnAreAsLargeAsTheSlowestAsksForAndAllLeaveRoomFor) {
  int blocks = 8;
  for (const int environments : {1, 15, 64, 256, 1024, 10'000}) {
    const TeamStage stage = one_turn_stage(environments, 1, 8, resident);
    EXPECT_LE(stage.blocks, blocks);  // the more there are, the smaller
    EXPECT_EQ(stage.teams, std::min(environments, resident(stage.blocks)));
    EXPECT_EQ(stage.leave_at, 0);
    blocks = stage.blocks;
  }
  EXPECT_EQ(one_turn_stage(64, 1, 8, resident).blocks, 8);
  EXPECT_EQ(blocks, 1);
  // Over more steps environments are more alike.
  EXPECT_LT(one_turn_stage(64, 10, 8, resident).blocks, 8);
  EXPECT_EQ(one_turn_stage(3, 1, 8, [](int) { return 0; }).teams, 0);
}

TEST(TeamStages, WithoutRoomThereAreNone) {
  EXPECT_TRUE(team_stages(3, 8, [](int) { return 0; }).empty());
  const auto stages = team_stages(3, 8, [](int blocks) { return blocks <= 2 ? 1 : 0; });
  ASSERT_EQ(stages.size(), 2u);
  EXPECT_EQ(stages[0].blocks, 1);
  EXPECT_EQ(stages[0].leave_at, 2);
}

}  // namespace
}  // namespace flash::sim::cuda
