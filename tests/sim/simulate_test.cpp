#include <gtest/gtest.h>

#include <cmath>

#include "data/error.h"
#include "tests/sim/sheet_scene.h"

namespace flash::sim {
namespace {

// A plate needs a flat rest shape. What a worker finds out must reach the caller, not end the program.
TEST(Simulate, WhatAWorkerThrowsReachesTheCaller) {
  data::TriangleMesh curved = data::rectangle({.width = 0.1, .height = 0.1, .cells_x = 3, .cells_y = 3});
  for (Eigen::Index i = 0; i < curved.vertices.rows(); ++i)
    curved.vertices(i, 2) = 5 * curved.vertices(i, 0) * curved.vertices(i, 0);
  const Sheet sheet = make_sheet(curved);
  Environment environment = environment_of(sheet);
  environment.material.bending_model = data::BendingModel::plate;
  for (const int threads : {1, 2, 4})
    EXPECT_THROW(simulate(sheet, std::vector(4, environment), 2, {}, threads), data::InputError) << threads;
}

TEST(Simulate, StopsBeforeTheNextStepWhenAsked) {
  const Sheet sheet = small_sheet();
  std::atomic<bool> stop = true;
  SolverSettings settings;
  settings.stop = &stop;
  // A million steps would take minutes.
  EXPECT_THROW(simulate(sheet, {environment_of(sheet)}, 1'000'000, settings, 1), data::Stopped);
  stop = false;
  EXPECT_EQ(simulate(sheet, {environment_of(sheet)}, 2, settings, 1).front().reports.size(), 2u);
}

TEST(Simulate, TheWorstOfTwoIsNeverLostForNotBeingANumber) {
  EXPECT_EQ(worst(1, 2), 2);
  EXPECT_EQ(worst(2, 1), 2);
  EXPECT_TRUE(std::isinf(worst(1, NAN)));
  EXPECT_TRUE(std::isinf(worst(NAN, 1)));
}

}  // namespace
}  // namespace flash::sim
