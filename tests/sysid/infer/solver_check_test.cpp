#include "sysid/infer/solver_check.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/sysid/short_lift.h"

namespace flash::sysid {
namespace {

GridSettings bending_grid() {
  GridSettings grid;
  grid.base.material = short_lift_material();
  grid.axes = {parse_axis("bending", "5e-5:1e-3:5:log")};
  return grid;
}

TEST(SolverCheck, FinerSolutionsMoveAResolvedMotionLittle) {
  const data::TemporaryFolder folder;
  const std::vector<Replay> replays = {short_lift(folder)};
  const MotionStore store(folder / "motions");
  const ReplayCandidate candidate = candidate_at({2e-4}, bending_grid());
  const std::vector<FinerSolution> finer = finer_solutions(finer_settings(replays), candidate, store);
  ASSERT_EQ(finer.size(), 2u);
  EXPECT_EQ(finer[0].what, "half_step");
  EXPECT_EQ(finer[1].what, "four_times_iterations");
  EXPECT_EQ(finer[0].replays[0].settings.solver.time_step, replays[0].settings.solver.time_step / 2);
  EXPECT_EQ(finer[1].replays[0].settings.solver.max_iterations,
            4 * replays[0].settings.solver.max_iterations);
}

TEST(SolverCheck, ExplainsAMotionByTheParameters) {
  const data::TemporaryFolder folder;
  const std::vector<Replay> replays = {short_lift(folder)};
  const GridSettings grid = bending_grid();
  const Sensitivity sensitivity = measure_sensitivity(replays, grid, {2e-4});
  const std::vector<ReplayResult> other = run(replays[0], {candidate_at({2e-4 * 1.05}, grid)});
  const SolverCheck found =
      compare_solutions("", sensitivity, replays, sensitivity.motions, replays, other, grid.axes);
  // What is not linear over 10 % is a few per cent of 5 %.
  EXPECT_NEAR(found.shift.at("bending"), std::log(1.05), 0.005);
  GridSettings by_four_threads = grid;
  by_four_threads.threads = 4;
  EXPECT_EQ(measure_sensitivity(replays, by_four_threads, {2e-4}).parameters, sensitivity.parameters);
}

}  // namespace
}  // namespace flash::sysid
