#include "sysid/report/plan_start.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/sysid/summary_fixture.h"

namespace flash::sysid {
namespace {

TEST(PlanStart, HasTheCovarianceOfTheDrawsInTheCoordinatesOfTheAxes) {
  SearchFolder search{example_summary(), {}};
  search.results.axes = {parse_axis("poisson", "0,0.2,0.4"), parse_axis("air_drag", "0.5"),
                         parse_axis("bending", "1e-5,1e-4,1e-3")};  // listed, and yet of its logarithm
  search.summary.samples = Eigen::MatrixXd(3, 2);
  search.summary.samples << 0.1, 1e-4, 0.2, 2e-4, 0.3, 4e-4;
  search.summary.fixed["areal_density"].deviation = 0.01;
  search.summary.recordings[0].misfit.noise = 1e-3;
  PlanSettings settings;
  settings.at = {1, 2, 3};  // of ranges, which give way
  settings.error = 0.007;
  start_plan(search, settings);
  ASSERT_EQ(settings.grid.axes.size(), 3u);
  EXPECT_TRUE(settings.grid.axes[2].logarithmic);
  EXPECT_EQ(settings.at, (std::vector<double>{0.2, 0.5, 1e-4}));
  ASSERT_TRUE(settings.known);
  // Of the searched alone, by hand: 0.1 and log 2 to both sides of the middle of three draws.
  Eigen::Matrix2d expected;
  expected << 0.01, 0.1 * std::log(2), 0.1 * std::log(2), std::log(2) * std::log(2);
  ASSERT_EQ(settings.known->covariance.rows(), 2);
  EXPECT_LT((settings.known->covariance - expected).norm(), 1e-12);
  EXPECT_NEAR(settings.known->misfit.noise, 1e-3, 1e-15);
  EXPECT_EQ(settings.known->duration, duration_of(search.summary.recordings[0]));
  ASSERT_EQ(settings.grid.fixed.size(), 1u);  // what was measured
  EXPECT_EQ(settings.grid.fixed[0].name, "friction");
  EXPECT_EQ(settings.grid.deviations.at("areal_density"), 0.01);
  EXPECT_EQ(settings.error, 0.007);
}

}  // namespace
}  // namespace flash::sysid
