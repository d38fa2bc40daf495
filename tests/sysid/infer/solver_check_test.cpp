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

TEST(SolverCheck, NamesWhatItChangedAndExplainsItByTheParameters) {
  const data::TemporaryFolder folder;
  const std::vector<Replay> replays = {short_lift(folder)};
  const GridSettings grid = bending_grid();
  const std::vector<SolverCheck> checks = check_solver(replays, grid, {2e-4});
  ASSERT_EQ(checks.size(), 4u);
  EXPECT_EQ(checks[0].what, "estimate_itself");
  EXPECT_EQ(checks[0].shift.at("bending"), 0);
  EXPECT_EQ(checks[1].what, "half_step");
  EXPECT_EQ(checks[2].what, "double_mesh");
  EXPECT_EQ(checks[3].what, "four_times_iterations");
  // Cells of half the bending length against steps and a tolerance that resolve the motion.
  EXPECT_GT(checks[2].surface_change_m, 5 * checks[1].surface_change_m);
  EXPECT_GT(checks[2].surface_change_m, 5 * checks[3].surface_change_m);

  const Sensitivity sensitivity = measure_sensitivity(replays, grid, {2e-4});
  const std::vector<ReplayResult> other = run(replays[0], {candidate_at({2e-4 * 1.05}, grid)});
  const SolverCheck found =
      compare_solutions("", sensitivity, replays, sensitivity.motions, replays, other, grid);
  // What is not linear over 10 % is a few per cent of 5 %.
  EXPECT_NEAR(found.shift.at("bending"), std::log(1.05), 0.005);
}

TEST(SolverCheck, ASheetFromAFileHasNoFinerMesh) {
  const data::TemporaryFolder folder;
  Replay replay = short_lift(folder);
  replay.recording.mesh_spec = "sheet.obj";
  for (const SolverCheck& check : check_solver({replay}, bending_grid(), {2e-4}))
    EXPECT_NE(check.what, "double_mesh");
}

}  // namespace
}  // namespace flash::sysid
