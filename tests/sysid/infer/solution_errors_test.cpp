#include "sysid/infer/solution_errors.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/sysid/short_lift.h"

namespace flash::sysid {
namespace {

ReplayResult at_height(double height) {
  ReplayResult result;
  result.motion.positions = {data::Points::Constant(4, 3, height)};
  return result;
}

TEST(SolutionErrors, TheObservedRatioIsThatOfBothHalvings) {
  const std::vector<ReplayResult> cells = {at_height(1)}, halves = {at_height(1.5)},
                                  quarters = {at_height(1.75)}, far = {at_height(2.5)};
  EXPECT_NEAR(observed_ratio({cells, halves}, {halves, quarters}), 0.5, 1e-14);
  EXPECT_NEAR(observed_ratio({cells, halves}, {halves, far}), 2, 1e-14);
}

TEST(SolutionErrors, TwoHalvingsOfTheStepLeadToNoStep) {
  const data::TemporaryFolder folder;
  // Steps that follow how the strip swings, which those of 10 ms do not.
  const std::vector<Replay> replays = with_step({short_lift(folder)}, 1.0 / 64), none;
  GridSettings grid;
  grid.base.material = short_lift_material();
  grid.axes = {parse_axis("bending", "1e-4:4e-4:3:log")};
  const AnswerSettings settings;
  const MotionStore store(folder / "motions");
  const TellWork untold;
  const Task task{replays, none, grid, grid.axes, settings, store, untold};
  const std::vector<double> values = {2e-4};
  const std::vector<KnownError> errors = errors_of_step(task, values);
  ASSERT_EQ(errors.size(), 1u);
  EXPECT_TRUE(errors[0].corrects);
  EXPECT_TRUE(is_of_solution(errors[0]));
  ASSERT_EQ(errors[0].terms.size(), 2u);

  // Where the sheet is at last, with the step, half of it, a quarter and a sixteenth.
  const auto last = [&](const ReplayResult& result) {
    const Motion& motion = result.motion;
    const double steps = (replays[0].observations.back().t - motion.start) / motion.step;
    return motion.positions.at(static_cast<std::size_t>(std::lround(steps)));
  };
  const ReplayCandidate candidate = candidate_at(values, grid);
  const data::Points own = last(store.run(replays[0], candidate)),
                     exact = last(store.run(with_step(replays, 1.0 / 16)[0], candidate)),
                     half = last(errors[0].terms[0].motions->results[0]),
                     quarter = last(errors[0].terms[1].motions->results[0]);
  const data::Points extrapolated =
      half + errors[0].terms[0].factor * half + errors[0].terms[1].factor * quarter;
  // Of first order: a quarter of the step is 7/32 wrong where half of it is 15/32 and the whole 31/32. What
  // is left after the extrapolation is of second order.
  EXPECT_LT((half - exact).norm(), 0.6 * (own - exact).norm());
  EXPECT_LT((extrapolated - exact).norm(), 0.5 * (quarter - exact).norm());
}

TEST(SolutionErrors, CellsAreHalvedTwiceWhereTheyAreCoarseAndFollowTheEstimate) {
  const data::TemporaryFolder folder;
  const std::vector<Replay> replays = {short_corner_lift(folder, 0.3)}, none;
  GridSettings grid;
  grid.base.material = short_lift_material();
  grid.axes = {parse_axis("bending", "2e-4:2e-2:3:log")};
  const AnswerSettings settings;
  const MotionStore store(folder / "motions");
  const TellWork untold;
  const Task task{replays, none, grid, grid.axes, settings, store, untold};
  const auto errors_at = [&](double bending) {
    return errors_of_cells(task, Emulator{}, {bending},
                           {store.run(replays[0], candidate_at({bending}, grid))});
  };

  // A fold of 0.22 m.
  const std::vector<KnownError> stiff = errors_at(2e-2);
  ASSERT_EQ(stiff.size(), 1u);
  EXPECT_EQ(stiff[0].name, half_sheet_cells);
  EXPECT_NEAR(stiff[0].terms[1].factor, 4.0 / 3, 1e-12);
  EXPECT_EQ(stiff[0].spread, 1);

  // One of 47 mm.
  std::vector<KnownError> limp = errors_at(2e-4);
  ASSERT_GE(limp.size(), 2u);
  EXPECT_EQ(limp[0].name, half_sheet_cells);
  EXPECT_EQ(limp[0].terms[1].factor, 1);
  EXPECT_EQ(limp[1].name, quarter_sheet_cells);
  for (const KnownError& error : {limp[0], limp[1]}) {
    EXPECT_TRUE(error.corrects);
    EXPECT_TRUE(is_of_solution(error));
    EXPECT_GE(error.spread, 0.25);
    EXPECT_LE(error.spread, 0.5);
  }
  EXPECT_NEAR(limp[1].terms[1].factor, 1 / (1 - limp[1].spread), 1e-12);

  // Posteriors of a deviation of a tenth, at the estimate where they were found and away from it.
  const auto posterior_at = [&](double bending) {
    Posterior posterior{grid.axes, {}, {}, {}};
    const double at = std::log(bending);
    posterior.estimate = Eigen::VectorXd::Constant(1, at);
    posterior.samples.resize(2, 1);
    posterior.samples << at - 0.1, at + 0.1;
    return posterior;
  };
  EXPECT_FALSE(has_left_cells(posterior_at(2.09e-4), limp));
  EXPECT_TRUE(has_left_cells(posterior_at(2.11e-4), limp));
  const KnownError before = limp[0];
  ASSERT_TRUE(follow_with_cells(task, {2.11e-4}, limp));
  EXPECT_FALSE(has_left_cells(posterior_at(2.11e-4), limp));
  EXPECT_EQ(limp[0].terms[1].factor, before.terms[1].factor);
  const data::Points was = before.terms[1].motions->results[0].motion.positions.back(),
                     is = limp[0].terms[1].motions->results[0].motion.positions.back();
  EXPECT_GT((is - was).cwiseAbs().maxCoeff(), 1e-6);

  // From where cells are not coarse to where they are.
  std::vector<KnownError> arrived = stiff;
  ASSERT_TRUE(follow_with_cells(task, {2e-4}, arrived));
  ASSERT_EQ(arrived.size(), limp.size());
  for (std::size_t e = 0; e < limp.size(); ++e) {
    EXPECT_EQ(arrived[e].name, limp[e].name);
    EXPECT_EQ(arrived[e].spread, limp[e].spread);
  }

  const auto warnings_at = [&](double bending, const std::vector<KnownError>& errors) {
    std::vector<std::string> warnings;
    warn_of_cells(task, {bending}, errors, warnings);
    return warnings;
  };
  EXPECT_TRUE(warnings_at(2e-2, stiff).empty());
  ASSERT_EQ(warnings_at(2e-4, {limp[0], limp[1]}).size(), 1u);  // they are coarse
  const std::vector<std::string> once = warnings_at(2e-4, stiff), never = warnings_at(2e-2, {});
  ASSERT_EQ(once.size(), 2u);
  EXPECT_NE(once[1].find("halved once alone"), std::string::npos);
  ASSERT_EQ(never.size(), 1u);
  EXPECT_NE(never[0].find("not corrected for the cells of the sheet"), std::string::npos);
}

TEST(SolutionErrors, OfTheStepAreNotAskedForWithoutASolverCheck) {
  const data::TemporaryFolder folder;
  const std::vector<Replay> replays = {short_lift(folder)}, none;
  const GridSettings grid;
  AnswerSettings settings;
  settings.solver_check = false;
  const MotionStore store(folder / "motions");
  const TellWork untold;
  const Task task{replays, none, grid, grid.axes, settings, store, untold};
  EXPECT_TRUE(errors_of_step(task, {}).empty());
}

}  // namespace
}  // namespace flash::sysid
