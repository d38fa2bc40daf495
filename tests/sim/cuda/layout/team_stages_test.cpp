#include "sim/cuda/layout/team_stages.h"

#include <gtest/gtest.h>

namespace flash::sim::cuda {
namespace {

/// Of a card with 132 processors in groups of 16 or 18.
int resident(int blocks) { return blocks == 1 ? 132 : blocks == 2 ? 66 : blocks == 4 ? 30 : 15; }

TEST(TeamStages, FewEnvironmentsHaveTheLargestTeams) {
  for (const int environments : {1, 15, 30}) {
    const auto stages = team_stages(environments, 2, 8, resident);
    ASSERT_EQ(stages.size(), 1u);
    EXPECT_EQ(stages[0].blocks, 8);
    EXPECT_EQ(stages[0].teams, std::min(environments, 15));
    EXPECT_EQ(stages[0].leave_at, 0);
  }
}

TEST(TeamStages, LeaveToLargerOnesWhatThoseCanTakeInSoManyTurns) {
  for (const int turns : {1, 2, 3})
    for (const int environments : {16, 64, 133, 1024}) {
      const auto stages = team_stages(environments, turns, 8, resident);
      ASSERT_FALSE(stages.empty());
      EXPECT_LT(stages.front().leave_at, environments);
      EXPECT_EQ(stages.back().blocks, 8);
      EXPECT_EQ(stages.back().leave_at, 0);
      for (std::size_t k = 0; k + 1 < stages.size(); ++k) {
        EXPECT_EQ(stages[k + 1].blocks, 2 * stages[k].blocks);
        EXPECT_EQ(stages[k].leave_at, turns * resident(stages[k + 1].blocks));
      }
      // No larger teams would do to start with.
      if (stages.front().blocks > 1) {
        EXPECT_LE(environments, turns * resident(stages.front().blocks));
      }
    }
}

TEST(TeamStages, WithoutRoomThereAreNone) {
  EXPECT_TRUE(team_stages(3, 2, 8, [](int) { return 0; }).empty());
  const auto stages = team_stages(3, 2, 8, [](int blocks) { return blocks <= 2 ? 1 : 0; });
  ASSERT_EQ(stages.size(), 2u);
  EXPECT_EQ(stages[0].blocks, 1);
  EXPECT_EQ(stages[0].leave_at, 2);
}

}  // namespace
}  // namespace flash::sim::cuda
