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
  EXPECT_NEAR(observed_ratio({at_height(1)}, {at_height(1.5)}, {at_height(1.75)}), 0.5, 1e-14);
  EXPECT_NEAR(observed_ratio({at_height(1)}, {at_height(1.5)}, {at_height(2.5)}), 2, 1e-14);
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
  EXPECT_TRUE(is_found_once(errors[0]));
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
