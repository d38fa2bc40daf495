#include "sysid/observe/horizon.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/sysid/short_lift.h"

namespace flash::sysid {
namespace {

/// Mean distance of the vertices themselves at each keyframe [m], which bounds that of the surfaces.
std::vector<double> apart_at_keyframes(const Replay& replay, const ReplayCandidate& a,
                                       const ReplayCandidate& b) {
  const std::vector<ReplayResult> both = run(replay, {a, b});
  std::vector<double> apart;
  for (const Observation& observation : replay.observations) {
    data::Points at_a, at_b;
    surface_at(both[0].motion, observation.t, at_a);
    surface_at(both[1].motion, observation.t, at_b);
    apart.push_back((at_a - at_b).rowwise().norm().mean());
  }
  return apart;
}

// The horizon is no earlier than the first keyframe at which the vertices reach the limit, and there is none
// where they never do.
TEST(Horizon, IsWhereTwoNearlyEqualMotionsPart) {
  const data::TemporaryFolder folder;
  const Replay replay = short_lift(folder);
  const MotionStore store(folder / "motions");
  ReplayCandidate candidate;
  candidate.material = short_lift_material();
  ReplayCandidate other = candidate;
  other.material.bending_rigidity *= 1.5;
  const std::vector<double> apart = apart_at_keyframes(replay, candidate, other);
  const double most = *std::max_element(apart.begin(), apart.end());
  ASSERT_GT(most, 1e-4);
  const auto horizon = [&](double limit) {
    return predictability_horizons({replay}, candidate, {{"bending", other}}, store, limit).front();
  };
  EXPECT_FALSE(horizon(1.01 * most));
  EXPECT_EQ(horizon(-1)->t, replay.observations.front().t);
  // Both motions begin alike: a tenth of where they end is crossed on the way.
  const double limit = 0.1 * most;
  const auto found = horizon(limit);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->parameter, "bending");
  for (std::size_t k = 0; k < apart.size(); ++k) {
    if (replay.observations[k].t != found->t) continue;
    EXPECT_GT(apart[k], limit);
  }
  EXPECT_GT(found->t, replay.observations.front().t);
  // Equal motions never part.
  EXPECT_FALSE(predictability_horizons({replay}, candidate, {{"bending", candidate}}, store, 1e-12).front());
}

// Each parameter parts the motion by itself, and the first of all decides, whatever their order.
TEST(Horizon, IsThatOfTheParameterThatPartsTheMotionFirst) {
  const data::TemporaryFolder folder;
  const std::vector<Replay> replays = {short_lift(folder)};
  const MotionStore store(folder / "motions");
  ReplayCandidate candidate;
  candidate.material = short_lift_material();
  std::vector<NearbyCandidate> nearby = {
      {"friction", candidate}, {"bending", candidate}, {"young", candidate}};
  nearby[0].candidate.material.friction *= 1.1;
  nearby[1].candidate.material.bending_rigidity *= 1.5;
  nearby[2].candidate.material.membrane_stiffness *= 1.001;
  constexpr double kLimit = 3e-5;
  std::optional<Horizon> first;
  for (const NearbyCandidate& each : nearby) {
    const auto alone = predictability_horizons(replays, candidate, {each}, store, kLimit).front();
    if (alone && (!first || alone->t < first->t)) first = alone;
  }
  ASSERT_TRUE(first);
  for (int order = 0; order < 2; ++order) {
    const auto all = predictability_horizons(replays, candidate, nearby, store, kLimit).front();
    ASSERT_TRUE(all);
    EXPECT_EQ(all->t, first->t);
    EXPECT_EQ(all->parameter, first->parameter);
    std::reverse(nearby.begin(), nearby.end());
  }
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
