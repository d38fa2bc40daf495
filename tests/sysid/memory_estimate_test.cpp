#include "sysid/memory_estimate.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "tests/sysid/short_lift.h"

namespace flash::sysid {
namespace {

GridSettings grid_over(const std::string& bending) {
  GridSettings grid;
  grid.base.material = short_lift_material();
  grid.axes = {parse_axis("bending", bending)};
  return grid;
}

TEST(MemoryEstimate, KeptMotionsHoldTheStepsAboutTheirKeyframes) {
  const data::TemporaryFolder folder;
  const std::vector<Replay> replays = {short_lift(folder)};
  GridSettings grid = grid_over("1e-4:4e-4:3:log");
  EXPECT_EQ(estimate_memory(replays, grid, true).kept, 0);
  grid.rollouts = folder / "rollouts";

  const Replay& replay = replays.front();
  std::set<long> steps = {0, replay.steps};
  for (const Observation& observation : replay.observations) {
    const double step = (observation.t - replay.start) / replay.settings.solver.time_step;
    steps.insert(std::lround(std::floor(step + 1e-6)));
    steps.insert(std::lround(std::ceil(step - 1e-6)));
  }
  ASSERT_LT(steps.size(), static_cast<std::size_t>(replay.steps));
  const double motion = static_cast<double>(steps.size() * sizeof(double)) *
                        static_cast<double>(replay.sheet.rest.vertices.size());
  // Three of the search's mesh while three of four times as many vertices are made splines of, held twice.
  EXPECT_DOUBLE_EQ(estimate_memory(replays, grid, true).kept, (3 + 2 * 3 * 4) * motion);
}

TEST(MemoryEstimate, GrowsWithWhatIsInWorkAtOnce) {
  const data::TemporaryFolder folder;
  const std::vector<Replay> replays = {short_lift(folder)};
  GridSettings grid = grid_over("1e-4:4e-4:9:log");
  const double one = estimate_memory(replays, grid, false).simulation;
  EXPECT_DOUBLE_EQ(estimate_memory(replays, grid, true).simulation, 4 * one);  // of half the cell
  grid.threads = 6;
  EXPECT_DOUBLE_EQ(estimate_memory(replays, grid, false).simulation, 6 * one);
  EXPECT_DOUBLE_EQ(estimate_memory(replays, grid, true).simulation, 6 * one);  // checks come one by one
  grid.envs = 5;                                                               // the fewer of the two
  EXPECT_DOUBLE_EQ(estimate_memory(replays, grid, false).simulation, 5 * one);
}

TEST(MemoryEstimate, WhatCannotFitOrEndIsRefusedWithTheRightAdvice) {
  const data::TemporaryFolder folder;
  std::vector<Replay> replays = {short_lift(folder)};
  const MemoryEstimate small = estimate_batch(replays, 1);
  EXPECT_NO_THROW(check_job(replays, 1, small, 0));
  EXPECT_NO_THROW(check_job(replays, 1, small, 2 * small.total()));
  const auto advice = [&](double candidates, double machine) {
    return data::input_error_of([&] { check_job(replays, candidates, estimate_batch(replays, 1), machine); });
  };
  EXPECT_NE(advice(1, 1e6).find("at most the 1 MB that there are: use a coarser --mesh"), std::string::npos);
  EXPECT_NE(advice(1e12, 0).find("years: use fewer values"), std::string::npos);
  replays.front().steps = 1'000'000;
  EXPECT_NE(advice(1, 1e8).find("a longer --time-step"), std::string::npos);
  EXPECT_EQ(advice(1, 0), "");
}

}  // namespace
}  // namespace flash::sysid
