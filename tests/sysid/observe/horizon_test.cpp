#include "sysid/observe/horizon.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/sysid/short_lift.h"

namespace flash::sysid {
namespace {

// What the vertices themselves are apart bounds what the surfaces are: the horizon is no earlier than the
// first keyframe at which that reaches the limit, and there is none where it never does.
TEST(Horizon, IsWhereTwoNearlyEqualMotionsPart) {
  const data::TemporaryFolder folder;
  const Replay replay = short_lift(folder);
  const MotionStore store(folder / "motions");
  ReplayCandidate candidate;
  candidate.material = short_lift_material();
  constexpr double kPerturbation = 0.2;
  ReplayCandidate other = candidate;
  other.material.bending_rigidity *= 1 + kPerturbation;
  other.material.membrane_stiffness *= 1 + kPerturbation;
  other.material.friction *= 1 + kPerturbation;
  const std::vector<ReplayResult> both = run(replay, {candidate, other});
  std::vector<double> apart;
  for (const Observation& observation : replay.observations) {
    data::Points a, b;
    surface_at(both[0].motion, observation.t, a);
    surface_at(both[1].motion, observation.t, b);
    apart.push_back((a - b).rowwise().norm().mean());
  }
  const double most = *std::max_element(apart.begin(), apart.end());
  ASSERT_GT(most, 1e-4);
  EXPECT_FALSE(predictability_horizon(replay, candidate, store, 1.01 * most, kPerturbation));
  EXPECT_EQ(predictability_horizon(replay, candidate, store, -1, kPerturbation),
            replay.observations.front().t);
  // Both motions begin alike: a tenth of where they end is crossed on the way.
  const double limit = 0.1 * most;
  const auto found = predictability_horizon(replay, candidate, store, limit, kPerturbation);
  ASSERT_TRUE(found);
  for (std::size_t k = 0; k < apart.size(); ++k) {
    if (replay.observations[k].t != *found) continue;
    EXPECT_GT(apart[k], limit);
  }
  EXPECT_GT(*found, replay.observations.front().t);
  // Equal motions never part.
  EXPECT_FALSE(predictability_horizon(replay, candidate, store, 1e-12, 0));
}

TEST(Horizon, ARecordingIsNeverLeftWithoutKeyframes) {
  Replay replay;
  replay.observations = {{1.0, data::Points::Zero(5, 3), 1}};
  EXPECT_EQ(drop_beyond_horizon(0.5, replay), 0);
  EXPECT_EQ(replay.observations[0].weight, 1);
}

TEST(Horizon, KeyframesBeyondItAreCounted) {
  Replay replay;
  for (const double t : {0.0, 1.0, 2.0, 3.0}) replay.observations.push_back({t, data::Points::Zero(5, 3), 1});
  replay.observations[3].weight = 0;
  EXPECT_EQ(drop_beyond_horizon(std::nullopt, replay), 0);
  EXPECT_EQ(drop_beyond_horizon(1.0, replay), 2);
  EXPECT_EQ(replay.observations[0].weight, 1);
  EXPECT_EQ(replay.observations[1].weight, 0);
}

}  // namespace
}  // namespace flash::sysid
