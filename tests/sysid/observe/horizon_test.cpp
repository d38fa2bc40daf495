#include "sysid/observe/horizon.h"

#include <gtest/gtest.h>

namespace flash::sysid {
namespace {

TEST(Horizon, ARecordingIsNeverLeftWithoutKeyframes) {
  Replay replay;
  replay.observations = {{1.0, data::Points::Zero(5, 3), 1}};
  drop_beyond_horizon(0.5, replay);
  EXPECT_EQ(replay.observations[0].weight, 1);
}

}  // namespace
}  // namespace flash::sysid
