#include "tests/sim/scene_findings.h"

#include <gtest/gtest.h>

namespace flash::sim {
namespace {

/// What holds of a scene, whether solved or not.
void expect_sound(const SceneFindings& found, unsigned long seed) {
  EXPECT_TRUE(found.finite) << seed;
  EXPECT_LT(found.unseen_depth, 1e-4) << seed;
  EXPECT_LT(found.free_depth, 1e-9) << seed;
  EXPECT_EQ(found.crossed, 0) << seed;
  EXPECT_LT(found.energy_gain_share, 1e-2) << seed;
}

/// Forty of the scenes of `make random-scenes`, which draws a thousand.
TEST(RandomScenes, AreSolvedOrSaidNotToBe) {
  int unsolved = 0;
  for (unsigned long seed = 20001; seed <= 20040; ++seed) {
    const SceneFindings found = observe(random_scene(seed));
    expect_sound(found, seed);
    if (found.unconverged > 0) {
      ++unsolved;
    } else {
      EXPECT_LT(found.exit_speed, 1.1) << seed;
    }
  }
  EXPECT_LE(unsolved, 1);  // 2 % of the scenes
}

/// The same with capsules and spheres in place of all boxes and cylinders.
TEST(RandomScenes, WithRoundObstaclesAreSolvedOrSaidNotToBe) {
  int unsolved = 0;
  for (unsigned long seed = 20101; seed <= 20130; ++seed) {
    const SceneFindings found = observe(random_scene(seed, {.round = 1}));
    expect_sound(found, seed);
    unsolved += found.unconverged > 0;
  }
  EXPECT_LE(unsolved, 1);
  for (const unsigned long seed :
       {1, 2, 4, 5}) {  // 3 takes two minutes, with steps that are said not to be solved
    const SceneFindings found = observe(random_deep_start(seed, {.round = 1}));
    EXPECT_TRUE(found.finite) << seed;
    EXPECT_LT(found.unseen_depth, 1e-4) << seed;
    EXPECT_LT(found.free_depth, 1e-9) << seed;
  }
}

/// The same with surfaces of triangles: boxes, steps, grooves, bumps, rods, and open plates.
TEST(RandomScenes, WithMeshesAreSolvedOrSaidNotToBe) {
  int unsolved = 0;
  for (unsigned long seed = 20301; seed <= 20330; ++seed) {
    const SceneFindings found = observe(random_scene(seed, {.meshes = 1}));
    expect_sound(found, seed);
    unsolved += found.unconverged > 0;
  }
  EXPECT_LE(unsolved, 1);
}

/// Thirty of the blocks of `make random-scenes SOLIDS=1`. One may be crushed against a wall, which nothing
/// solves: it has to be said.
TEST(RandomScenes, OfSolidsAreSolvedOrSaidNotToBe) {
  int unsolved = 0;
  for (unsigned long seed = 20201; seed <= 20230; ++seed) {
    const SceneFindings found = observe(random_solid_scene(seed));
    expect_sound(found, seed);
    unsolved += found.unconverged > 0;
  }
  EXPECT_LE(unsolved, 1);
}

/// Scenes that once had eight and ten unsolved steps: a sheet so soft that its triangles become lines, and a
/// stiff one that slides under ten million times its weight.
TEST(RandomScenes, DrawnAndPressedSheetsAreSolved) {
  for (const unsigned long seed : {90645, 80180})
    EXPECT_LE(observe(random_scene(seed)).unconverged, 1) << seed;
}

/// Five of the sheets of `make deep-starts`, stiff ones that each vertex's own way out tore in two: they came
/// out at 35 to 88 m/s. What is strained by v sqrt(rho / (E t)) and let go moves at v; waves that meet add
/// up.
TEST(RandomScenes, SheetsThatStartInsideAreNotShotOut) {
  for (const unsigned long seed : {5, 11, 16, 43, 49}) {
    const SceneFindings found = observe(random_deep_start(seed));
    EXPECT_TRUE(found.finite) << seed;
    EXPECT_EQ(found.unconverged, 0) << seed;
    EXPECT_LT(found.unseen_depth, 1e-4) << seed;
    EXPECT_LT(found.free_depth, 1e-9) << seed;
    EXPECT_LT(found.shot_speed, 4.0) << seed;
  }
}

TEST(RandomScenes, TheSameSeedIsTheSameScene) {
  const SceneFindings first = observe(random_scene(7)), again = observe(random_scene(7));
  EXPECT_EQ(first.energy_gain, again.energy_gain);
  EXPECT_EQ(first.free_depth, again.free_depth);
}

}  // namespace
}  // namespace flash::sim
