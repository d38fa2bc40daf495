#include "tests/sim/random_layer_scenes.h"

#include <gtest/gtest.h>

namespace flash::sim {
namespace {

/// Some of the scenes of `make random-scenes LAYERS=1`: nothing passes, solved or not, and nothing comes from
/// nothing.
TEST(RandomLayerScenes, DoNotPass) {
  int touching = 0;
  for (const unsigned long seed : {2, 3, 6, 9, 12, 13, 16, 21, 26, 28, 29, 32}) {
    const LayerFindings found = observe(random_layer_scene(seed));
    EXPECT_TRUE(found.finite) << seed;
    EXPECT_EQ(found.passing, 0) << seed;
    EXPECT_LT(found.energy_gain_share, 1e-2) << seed;
    touching += found.touching > 0;
  }
  EXPECT_GE(touching, 4);
}

/// Newton's method alone, without duals, goes round in circles in these: what has to stop slides past its
/// place.
TEST(RandomLayerScenes, WhatSlidesComesToAStop) {
  for (const unsigned long seed : {40002, 40011, 40014, 40028, 40034, 40047}) {
    const LayerFindings found = observe(random_layer_scene(seed));
    EXPECT_GT(found.touching, 0) << seed;
    EXPECT_EQ(found.unconverged, 0) << seed;
  }
}

TEST(RandomLayerScenes, TheSameSeedIsTheSameScene) {
  const RandomLayerScene first = random_layer_scene(7), again = random_layer_scene(7);
  EXPECT_EQ(first.environment.state.positions, again.environment.state.positions);
  EXPECT_EQ(first.environment.state.velocities, again.environment.state.velocities);
}

}  // namespace
}  // namespace flash::sim
