#include "sysid/design/rank_experiments.h"

#include <gtest/gtest.h>

#include <cmath>

#include "sysid/design/virtual_experiment.h"
#include "tests/sysid/short_lift.h"

namespace flash::sysid {
namespace {

PlanSettings settings_of(double young_spread, double bending_spread) {
  PlanSettings settings;
  settings.grid.base.material = short_lift_material();
  settings.grid.axes = {{"young", {300, 3e4}, true}, {"bending", {2e-5, 2e-3}, true}};
  settings.grid.fixed = {parse_hold("areal_density=0.2:measured").axis};
  settings.at = {3e3, 2e-4};
  KnownSoFar known;
  known.covariance = Eigen::Vector2d(young_spread, bending_spread).cwiseAbs2().asDiagonal();
  known.misfit.noise = known.misfit.rough = 1e-3;
  known.misfit.rms = 1e-3;
  known.misfit.reach_time = 0.5;
  known.misfit.reach_sheet = 0.1;
  settings.known = known;
  return settings;
}

// What is flat has no curvature, whatever its rigidity. What hangs is stretched by its weight over E t,
// 0.2 kg/m^2 9.81 m/s^2 0.2 m / 3 kN/m: 0.01 %, a hundredth of the noise over 0.2 m, where a pull by 5 %
// takes newtons. So pulls tell the membrane, lifts and hangs the bending.
TEST(RankExperiments, ProposesWhatTellsTheParameterThatIsNotKnown) {
  const data::TemporaryFolder folder;
  const Replay lift = short_lift(folder);
  const MotionStore store(folder / "motions");
  const auto ranked = [&](double young_spread, double bending_spread) {
    return rank_experiments({lift}, settings_of(young_spread, bending_spread), store);
  };
  const auto membrane = ranked(1, 0.01), bending = ranked(0.01, 1);
  ASSERT_EQ(membrane.size(), 1 + virtual_experiments.size());
  EXPECT_TRUE(membrane[0].name == "bar_pull" || membrane[0].name == "bias_pull") << membrane[0].name;
  EXPECT_TRUE(bending[0].name == "corner_lift" || bending[0].name == "hang" ||
              bending[0].name == "lift again")
      << bending[0].name;
  for (const auto& each : {membrane, bending})
    for (std::size_t i = 0; i < each.size(); ++i) {
      if (i > 0) {
        EXPECT_LE(each[i].bits, each[i - 1].bits);
      }
      EXPECT_GE(each[i].bits, 0);
    }
  EXPECT_LE(membrane[0].spread[0], 1);
  EXPECT_LE(bending[0].spread[1], 1);
  // Half the log of a determinant's ratio; one parameter is all that is open.
  EXPECT_NEAR(bending[0].bits, std::log2(1 / bending[0].spread[1]), 0.02);
}

// What reaches over half a recording of twice the length reaches over the whole of this one's.
TEST(RankExperiments, ADiscrepancyReachesOverTheSameShareOfARecording) {
  const data::TemporaryFolder folder;
  const Replay lift = short_lift(folder);
  const MotionStore store(folder / "motions");
  const auto spread = [&](double reach, double duration) {
    PlanSettings settings = settings_of(1, 1);
    settings.known->misfit.reach_time = reach;
    settings.known->duration = duration;
    return plan_experiment("again", {lift}, settings, &store).spread[1];
  };
  const double own = mean_duration({lift});
  ASSERT_GT(own, 0);
  EXPECT_DOUBLE_EQ(spread(own, 2 * own), spread(own / 2, 0));
  EXPECT_NE(spread(own, 2 * own), spread(own, own));
}

// A discrepancy of centimetres leaves little to be told.
TEST(RankExperiments, ALargerMisfitPromisesLess) {
  const data::TemporaryFolder folder;
  const Replay lift = short_lift(folder);
  const MotionStore store(folder / "motions");
  PlanSettings settings = settings_of(0.01, 1);
  const double bits = plan_experiment("again", {lift}, settings, &store).bits;
  settings.known->misfit.rms = 2e-2;
  EXPECT_LT(plan_experiment("again", {lift}, settings, &store).bits, 0.5 * bits);
}

// Every stiffness is known to what the weight is known to, and no better, whatever is recorded.
TEST(RankExperiments, AnErrorOfTheWeightStays) {
  const data::TemporaryFolder folder;
  const Replay lift = short_lift(folder);
  const MotionStore store(folder / "motions");
  PlanSettings settings = settings_of(1, 1);
  const double measured = plan_experiment("again", {lift}, settings, &store).spread[1];
  settings.grid.fixed.clear();
  const double assumed = plan_experiment("again", {lift}, settings, &store).spread[1], weight = std::log(1.1);
  EXPECT_GT(assumed, weight);
  EXPECT_NEAR(assumed, std::hypot(measured, weight), 0.05 * assumed);
}

TEST(RankExperiments, CovarianceOfDrawsIsThatOfCoordinates) {
  Eigen::MatrixXd draws(3, 3);
  draws << 1, 0.3, 0.1, std::exp(1.0), 0.3, 0.2, std::exp(2.0), 0.3, 0.6;
  const Eigen::MatrixXd covariance = covariance_of_draws(
      {{"young", {1, 10}, true}, {"poisson", {0.3}, false}, {"friction", {0, 1}, false}}, draws);
  ASSERT_EQ(covariance.rows(), 2);
  EXPECT_NEAR(covariance(0, 0), 1, 1e-15);
  EXPECT_NEAR(covariance(1, 1), 0.07, 1e-15);  // (0.2^2 + 0.1^2 + 0.3^2) / 2
  EXPECT_NEAR(covariance(0, 1), 0.25, 1e-15);  // (0.2 + 0.3) / 2
}

}  // namespace
}  // namespace flash::sysid
