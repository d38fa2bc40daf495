#include "sysid/infer/weight_scale.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/sysid/short_lift.h"

namespace flash::sysid {
namespace {

// Motion alone knows ratios to the weight. A measured force knows the weight itself.
TEST(WeightScale, TheWeightScalesStiffnessesWhereNoForceWasMeasured) {
  const data::TemporaryFolder folder;
  std::vector<Replay> replays = {short_lift(folder)};
  GridSettings grid;
  grid.base.material = short_lift_material();
  grid.axes = {parse_axis("bending", "1e-4:4e-4:3:log")};
  EXPECT_NEAR(spread_of_scale(grid, replays), std::log(1.1), 1e-12);
  GridSettings measured = grid;
  measured.fixed = {parse_hold("areal_density=0.2:measured").axis};
  EXPECT_EQ(spread_of_scale(measured, replays), 0);
  measured.deviations["areal_density"] = 0.004;
  EXPECT_NEAR(spread_of_scale(measured, replays), 0.02, 1e-5);
  replays[0].observations.back().force = Eigen::Vector3d::UnitZ();
  EXPECT_EQ(spread_of_scale(grid, replays), 0);
}

// Ratios are as well known as before, the values themselves no better than the factor.
TEST(WeightScale, OneFactorOfAllStiffnessesLeavesTheirRatioAlone) {
  const std::vector<Axis> ranges = {parse_axis("bending", "1e-6:1e-2:9:log"),
                                    parse_axis("young", "1:10000:9:log")},
                          axes = {parse_axis("bending", "5e-5:2e-4:9:log"),
                                  parse_axis("young", "50:200:9:log")};
  const std::vector<std::vector<double>> points = cartesian_product(axes);
  Eigen::VectorXd deviance(static_cast<Eigen::Index>(points.size()));
  for (std::size_t i = 0; i < points.size(); ++i)
    deviance[static_cast<Eigen::Index>(i)] =
        std::pow(std::log(points[i][0] / 1e-4) / 0.1, 2) + std::pow(std::log(points[i][1] / 100) / 0.1, 2);
  const Posterior before = explore_posterior(axes, deviance);
  Posterior after = before;
  const Eigen::VectorXd factors = scale_together(after, {0, 1}, 0.2, ranges);
  const auto spread = [](const Eigen::VectorXd& x) {
    return std::sqrt((x.array() - x.mean()).square().mean());
  };
  EXPECT_LT(((after.samples.col(0) - after.samples.col(1)) - (before.samples.col(0) - before.samples.col(1)))
                .cwiseAbs()
                .maxCoeff(),
            1e-12);
  EXPECT_LT(
      (after.samples.col(0) - before.samples.col(0) - factors.array().log().matrix()).cwiseAbs().maxCoeff(),
      1e-12);
  // The mean square of n sums of a draw b and a factor f scatters by sqrt((2 f^4 + 4 b^2 f^2) / n).
  const double f2 = 0.2 * 0.2, n = static_cast<double>(before.samples.rows());
  for (Eigen::Index k = 0; k < 2; ++k) {
    const double b2 = std::pow(spread(before.samples.col(k)), 2);
    EXPECT_NEAR(std::pow(spread(after.samples.col(k)), 2), b2 + f2,
                4 * std::sqrt((2 * f2 * f2 + 4 * b2 * f2) / n));
  }
  EXPECT_EQ(after.estimate, before.estimate);
  // Nothing was searched beyond a range.
  Posterior cut = before;
  scale_together(cut, {0}, 0.2, axes);
  EXPECT_LE(cut.samples.col(0).maxCoeff(), std::log(2e-4));
  EXPECT_GE(cut.samples.col(0).minCoeff(), std::log(5e-5));
}

}  // namespace
}  // namespace flash::sysid
