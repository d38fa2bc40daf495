#include "sysid/emulate/search_memory.h"

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

TEST(SearchMemory, KeptMotionsHoldTheStepsAboutTheirKeyframes) {
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

TEST(SearchMemory, GrowsWithWhatIsInWorkAtOnce) {
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

}  // namespace
}  // namespace flash::sysid
