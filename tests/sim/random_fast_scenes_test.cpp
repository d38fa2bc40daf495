#include "tests/sim/random_fast_scenes.h"

#include <gtest/gtest.h>

#include "tests/sim/brute_passing.h"
#include "tests/sim/sheet_scene.h"
#include "tests/sim/solid_scene.h"

namespace flash::sim {
namespace {

using Eigen::Vector3d;

/// Some of the scenes of `make random-scenes FAST=1`: each search alone leads round what is in the way.
TEST(RandomFastScenes, NothingPassesSolvedOrNot) {
  for (const unsigned long seed : {8, 10, 18, 26, 33, 41, 42, 44, 46, 47, 54, 57}) {
    const FastFindings found = observe(random_fast_scene(seed));
    EXPECT_TRUE(found.finite) << seed;
    EXPECT_EQ(found.passing, 0) << seed;
    EXPECT_EQ(found.crossed, 0) << seed;
  }
}

TEST(RandomFastScenes, TheSameSeedIsTheSameScene) {
  const RandomFastScene first = random_fast_scene(7), again = random_fast_scene(7);
  EXPECT_EQ(first.environment.state.positions, again.environment.state.positions);
  EXPECT_EQ(first.environment.state.velocities, again.environment.state.velocities);
}

/// Two cubes 30 mm apart, of which one flies at 10 m/s and the other is at rest, `off` its way.
RandomFastScene one_cube_at_another(double off) {
  constexpr double side = 0.02, gap = 0.03, speed = 10;
  const std::vector<Sheet> both(2, solid_box(Vector3d::Constant(side), {2, 2, 2}));
  RandomFastScene scene;
  scene.kind = FastSceneKind::cubes;
  scene.sheet = joined(both);
  scene.steps = 4;
  scene.environment = environment_of(scene.sheet);
  scene.environment.materials.resize(2);
  for (int body = 0; body < 2; ++body) scene.environment.solids[body] = {.youngs_modulus = 1e6};
  scene.environment.gravity.setZero();
  scene.environment.self_contact = SelfContact{.thickness = 1e-3, .friction = 0.5, .pressure = 2500};
  rows_of(scene.sheet.bodies[1], scene.environment.state.positions).rowwise() +=
      Eigen::RowVector3d(side + gap, off, 0.5 * off);
  rows_of(scene.sheet.bodies[0], scene.environment.state.velocities).col(0).setConstant(speed);
  return scene;
}

TEST(FastBodies, ACubeAtTenMetresASecondMeetsOneAtRest) {
  for (const double off : {0.0, 0.004, 0.009}) {
    const FastFindings found = observe(one_cube_at_another(off));
    EXPECT_EQ(found.passing, 0) << off;
    EXPECT_GT(found.halved, 0) << off;  // in a step of 10 ms it would end five of its lengths behind
  }
  // Head on it stays behind, and pushes the other on.
  for (const double off : {0.0, 0.004}) {
    RandomFastScene scene = one_cube_at_another(off);
    Environment& environment = scene.environment;
    Solver solver(scene.sheet, scene.settings);
    for (int step = 0; step < scene.steps; ++step) {
      solver.step(environment);
      EXPECT_LT(rows_of(scene.sheet.bodies[0], environment.state.positions).col(0).mean(),
                rows_of(scene.sheet.bodies[1], environment.state.positions).col(0).mean());
    }
    EXPECT_GT(rows_of(scene.sheet.bodies[1], environment.state.velocities).col(0).mean(), 2);
  }
}

/// What the observer himself sees: a vertex and a face, two edges, also in one plane.
TEST(BrutePassing, SeesWhatMeetsOnTheWayAlone) {
  const Sheet one = small_sheet(2, 0.1);
  const std::vector<Sheet> both = {one, one};
  const Sheet sheet = joined(both);
  const BruteFeatures features(sheet,
                               std::vector<bool>(static_cast<std::size_t>(sheet.rest.vertices.rows())));
  data::Points start = sheet.rest.vertices;
  const auto first = [&](data::Points& x) { return rows_of(sheet.bodies[0], x); };
  first(start).col(2).array() += 0.01;
  const auto moved = [&](const Vector3d& by) {
    data::Points end = start;
    first(end).rowwise() += by.transpose();
    return end;
  };
  EXPECT_TRUE(brute_meetings(features, start, moved({0.01, 0.005, -0.009})).empty());
  EXPECT_FALSE(brute_meetings(features, start, moved({0.01, 0.005, -0.02})).empty());
  EXPECT_FALSE(brute_meetings(features, start, moved({0.01, 0.005, -5})).empty());
  EXPECT_TRUE(brute_meetings(features, start, moved({0, 0, 5})).empty());
  start = sheet.rest.vertices;
  first(start).col(0).array() += 0.15;
  EXPECT_FALSE(brute_meetings(features, start, moved({-0.4, 0.01, 0})).empty());
  EXPECT_TRUE(brute_meetings(features, start, moved({-0.04, 0.01, 0})).empty());
}

}  // namespace
}  // namespace flash::sim
