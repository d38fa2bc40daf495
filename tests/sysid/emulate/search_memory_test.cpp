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

  const Replay& replay = replays.front();
  std::set<long> steps = {0, replay.steps};
  for (const Observation& observation : replay.observations) {
    const double step = (observation.t - replay.start) / replay.settings.solver.time_step;
    steps.insert(std::lround(std::floor(step + 1e-6)));
    steps.insert(std::lround(std::ceil(step - 1e-6)));
  }
  ASSERT_LT(steps.size(), static_cast<std::size_t>(replay.steps));
  const double motion = static_cast<double>(steps.size() * sizeof(double)) *
                        static_cast<double>(replay.sheet().rest.vertices.size());
  // Three of the search's mesh while three of four times as many vertices are made splines of, held twice.
  EXPECT_DOUBLE_EQ(
      estimate_memory(replays, grid, true).kept,
      (3 + 2 * 3 * 4 + 14 + 4 * 48) * motion + 1e6 * static_cast<double>(replay.observations.size()));
}

TEST(SearchMemory, GrowsWithWhatIsInWorkAtOnce) {
  const data::TemporaryFolder folder;
  const std::vector<Replay> replays = {short_lift(folder)};
  GridSettings grid = grid_over("1e-4:4e-4:9:log");
  const auto simulation = [&](int envs, int threads) {
    grid.envs = envs;
    grid.threads = threads;
    return estimate_memory(replays, grid, false).simulation;
  };
  // A solver a thread; of each candidate the motion in its batch and the one that is scored.
  const double solver = sim::solver_bytes_per_vertex * vertices_of(replays.front());
  EXPECT_DOUBLE_EQ(simulation(9, 6) - simulation(9, 1), 5 * solver);
  EXPECT_DOUBLE_EQ(simulation(9, 1) - simulation(4, 1), 5 * 2 * motion_bytes(replays.front()));
  EXPECT_DOUBLE_EQ(simulation(64, 1), simulation(9, 1));  // there are no more candidates
  EXPECT_DOUBLE_EQ(simulation(5, 6), simulation(5, 5));   // nor threads than environments
  // Half the cell: four times as many vertices, as many at once.
  const double several = simulation(5, 2);
  EXPECT_DOUBLE_EQ(estimate_memory(replays, grid, true).simulation, 4 * several);
}

TEST(SearchMemory, CountsAQuarterOfTheCellsOfASheetThatMayBeLimpForThem) {
  const data::TemporaryFolder folder;
  const std::vector<Replay> replays = {short_corner_lift(folder, 0.3)};
  const auto simulation = [&](const std::string& bending) {
    GridSettings grid = grid_over(bending);
    grid.threads = 1;
    grid.envs = 1;
    return estimate_memory(replays, grid, true).simulation;
  };
  const double a_motion = motion_bytes(replays.front()),
               solver = sim::solver_bytes_per_vertex * vertices_of(replays.front());
  // One solver of sixteen times the vertices, and the motions of four meshes.
  EXPECT_DOUBLE_EQ(simulation("2e-4:2e-2:2:log"), 16 * solver + (16 + 4 + 4 + 1) * a_motion);
  EXPECT_LT(simulation("1e-2:2e-2:2:log"), 16 * solver);
}

}  // namespace
}  // namespace flash::sysid
