#include "sysid/infer/fit/fit.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>

#include "data/error.h"
#include "tests/sysid/short_lift.h"

namespace flash::sysid {
namespace {

FitSettings fit_of(std::vector<Axis> axes, std::vector<double> start) {
  FitSettings settings;
  settings.grid.base.material = short_lift_material();
  settings.grid.axes = std::move(axes);
  settings.start = std::move(start);
  return settings;
}

TEST(Fit, GlobalSearchLeavesAStartTurnedTheWrongWay) {
  const data::TemporaryFolder folder;
  const std::vector<Replay> replays = {short_lift(folder)};
  FitSettings settings =
      fit_of({{"bending", {1e-7, 1e-1}, true}, {"start_yaw", {-3, 3}, false}}, {1e-4, 2.8});
  const FitResult local = fit(replays, settings);
  EXPECT_GT(local.values[1], 2);  // the basin of the start: the sheet lies on the other side of the gripper

  settings.global = {8, 8, 11};
  std::size_t reported = 0;
  const FitResult result = fit(replays, settings, [&](const FitStep&) { ++reported; });
  ASSERT_EQ(result.covariance.rows(), 2);
  // Three spreads of the fit itself.
  EXPECT_NEAR(std::log(result.values[0] / 2e-4), 0, 3 * std::sqrt(result.covariance(0, 0)));
  EXPECT_NEAR(result.values[1], 0, 3 * std::sqrt(result.covariance(1, 1)));
  EXPECT_LT(result.best.score, 0.1 * local.best.score);

  EXPECT_EQ(reported, result.path.size());
  ASSERT_GT(result.path.size(), 8u);
  for (std::size_t i = 0; i < result.path.size(); ++i)
    EXPECT_EQ(result.path[i].stage, i < 8 ? FitStage::global : FitStage::local);
  const FitStep* best = nullptr;
  for (std::size_t i = 0; i < 8; ++i) {
    EXPECT_EQ(result.path[i].accepted, best == nullptr || result.path[i].cost < best->cost);
    if (result.path[i].accepted) best = &result.path[i];
  }
  EXPECT_EQ(result.path[8].values, best->values);  // where the refinement starts
  EXPECT_EQ(fit(replays, settings).values, result.values);
}

TEST(Fit, SaysWhyItEndedAndThatAStartAtTheEdgeWasNotRefined) {
  const data::TemporaryFolder folder;
  const std::vector<Replay> replays = {short_lift(folder)};
  const FitResult at_edge = fit(replays, fit_of({{"bending", {1e-3, 1e-2}, true}}, {1e-3}));  // truth: 2e-4
  EXPECT_FALSE(at_edge.refined);
  EXPECT_TRUE(at_edge.stuck);
  EXPECT_EQ(at_edge.termination,
            "nothing was refined: at the start bending is at the lower end of its range, and the cost falls "
            "only beyond; search a wider range first");
  const FitResult inside = fit(replays, fit_of({{"bending", {1e-5, 1e-2}, true}}, {1e-3}));
  EXPECT_TRUE(inside.refined);
  EXPECT_FALSE(inside.stuck);
  EXPECT_EQ(inside.termination.substr(0, 28), "the cost stands still after ");
}

TEST(Fit, EndsWithStoppedInTheMiddleAndAfterItsLastStep) {
  const data::TemporaryFolder folder;
  FitSettings settings = fit_of({{"bending", {1e-5, 1e-2}, true}}, {1e-3});
  settings.iterations = 2;
  for (std::size_t last = 0; last <= 2; ++last) {
    std::atomic<bool> stop = false;
    std::vector<Replay> replays = {short_lift(folder)};
    replays[0].settings.solver.stop = &stop;
    std::size_t reported = 0;
    const auto stop_at_last = [&](const FitStep&) {
      if (reported++ == last) stop = true;
    };
    EXPECT_THROW(fit(replays, settings, stop_at_last), data::Stopped);
    EXPECT_EQ(reported, last + 1);
  }
}

TEST(Fit, BothStagesHaveTheSameCost) {
  const data::TemporaryFolder folder;
  const std::vector<Replay> replays = {short_lift(folder)};
  // A coordinate of the search, to the last digit: the registration of a motion stops elsewhere for another.
  const double start = std::exp(std::log(2e-4));
  FitSettings settings = fit_of({{"bending", {1e-7, 1e-1}, true}}, {start});
  settings.priors = {{"bending", 4e-4, 2}};
  settings.global = {1, 3, 1};
  const FitResult result = fit(replays, settings);
  ASSERT_EQ(result.path[0].values[0], start);  // the start: nothing drawn is nearer to the truth
  int keyframes = 0;
  for (const Observation& observation : replays[0].observations)
    keyframes += observation.seen() && observation.weight > 0;
  // At the start chi^2 is the number of keyframes by its scale, and the prior is one spread away.
  EXPECT_NEAR(result.path[0].cost, (keyframes + 1) / 2.0, 1e-9 * keyframes);
  EXPECT_NEAR(result.path[1].cost, result.path[0].cost, 1e-9 * keyframes);  // Ceres' own sum
}

}  // namespace
}  // namespace flash::sysid
