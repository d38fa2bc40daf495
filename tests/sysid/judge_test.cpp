#include "sysid/judge.h"

#include <gtest/gtest.h>

#include <cmath>

#include "sysid/solver_check.h"
#include "tests/sysid/short_lift.h"

namespace flash::sysid {
namespace {

GridSettings bending_grid() {
  GridSettings grid;
  grid.base.material = short_lift_material();
  grid.axes = {parse_axis("bending", "5e-5:1e-3:5:log")};
  return grid;
}

JudgeSettings without_horizon() {
  JudgeSettings settings;
  settings.horizon = false;
  return settings;
}

TEST(Judge, WhereTheSimulatedEstimateIsWorseThanTheBestCandidateThatOneIsTheEstimate) {
  const data::TemporaryFolder folder;
  std::vector<Replay> replays = {short_lift(folder)};
  const GridSettings grid = bending_grid();
  // Scores that no simulation of noisy points reaches, least between the second and the third value.
  GridResults results{grid.axes, {"lift"}, {}};
  for (int i = 0; i < 5; ++i) {
    CandidateResult& candidate = results.candidates.emplace_back();
    candidate.id = i;
    candidate.values = {grid.axes[0].values[static_cast<std::size_t>(i)]};
    RecordingScore& recording = candidate.recordings.emplace_back();
    for (std::size_t k = 0; k < replays[0].observations.size(); ++k)
      recording.keyframes.push_back(
          {replays[0].observations[k].t, 1e-6 * (1 + std::pow(i - 1.6, 2)), 100, 1});
    candidate.score = recording.score = recording.keyframes.front().score;
  }
  const Summary summary = judge(results, replays, grid, without_horizon());
  ASSERT_FALSE(summary.solver_check.empty());
  EXPECT_GT(summary.solver_check.front().score, results.candidates[2].score);
  EXPECT_EQ(*summary.parameters.front().estimate, grid.axes[0].values[2]);
}

TEST(Judge, KeptMotionsGiveTheTruthBackBetweenTheValuesOfTheGrid) {
  const data::TemporaryFolder folder;
  std::vector<Replay> replays = {short_lift(folder, "sheet:0.2x0.05:0.0041666667:alternating_by_row")};
  ReplaySettings settings = replays[0].settings;
  settings.mesh = "sheet:0.2x0.05:0.0125";
  replays[0] = make_replay(replays[0].recording, settings);
  GridSettings grid = bending_grid();
  grid.rollouts = folder / "rollouts";
  ResultsStore store(folder / "run", grid.axes, {"lift"}, {}, Existing::refuse);
  ASSERT_TRUE(grid_search(replays, grid, store));
  GridResults results = store.results();
  const Summary summary = judge(results, replays, grid, without_horizon());
  const ParameterFinding& bending = summary.parameters.front();
  EXPECT_EQ(bending.identifiable, Identifiable::yes);
  EXPECT_LT((*bending.interval95)[0], 2e-4);
  EXPECT_GT((*bending.interval95)[1], 2e-4);
  // Cells of 12.5 mm alone are off by more; the finer mesh and the limit take that away.
  EXPECT_NEAR(*bending.estimate, 2e-4, 0.1 * 2e-4);
  EXPECT_EQ(bending.values.front(), grid.axes[0].values.front());
  EXPECT_EQ(bending.values.back(), grid.axes[0].values.back());
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
