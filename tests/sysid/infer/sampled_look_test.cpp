#include "sysid/infer/sampled_look.h"

#include <gtest/gtest.h>

#include <cmath>

namespace flash::sysid {
namespace {

TEST(SampledLook, PosteriorOfDrawsHasTheirModeQuantilesAndEnds) {
  // A Gaussian in two coordinates, which the first axis cuts off at its mean; the middle axis is held.
  std::vector<Axis> axes = {parse_axis("start_yaw", "0:1:3"), parse_axis("friction", "0.3"),
                            parse_axis("bending", "1e-5:1e-3:3:log")};
  const double centre = std::log(1e-4), sd = 0.1;
  const auto log_densities = [&](const Eigen::MatrixXd& points) -> Eigen::VectorXd {
    return -0.5 * ((points.col(0).array() / sd).square() + ((points.col(1).array() - centre) / sd).square());
  };
  const Eigen::Vector2d low(0, std::log(1e-5)), high(1, std::log(1e-3));
  const WeightedDraws draws = sample_by_importance(log_densities, low, high);
  const Posterior posterior = posterior_of(axes, draws);
  // Four standard deviations of a quantile by so many draws: its share's, over the density there.
  const auto tolerance = [&](double share, double density) {
    return 4 * std::sqrt(share * (1 - share) / draws.effective_size) / density;
  };
  EXPECT_NEAR(posterior.quantile(0, 0.95), 1.96 * sd, tolerance(0.95, 2 * 0.0584 / sd));
  EXPECT_NEAR(posterior.quantile(2, 0.5), centre, tolerance(0.5, 0.399 / sd));
  EXPECT_EQ(posterior.samples.col(1).minCoeff(), 0.3);
  EXPECT_EQ(posterior.samples.col(1).maxCoeff(), 0.3);
  // The mean under the eighth power: of a half Gaussian of sd / sqrt(8), sqrt(2 / pi) of that from the bound.
  EXPECT_NEAR(posterior.estimate[0], sd / std::sqrt(8) * std::sqrt(2 / M_PI), 0.1 * sd);
  EXPECT_NEAR(posterior.estimate[2], centre, 0.1 * sd);
  // At the mode's end the deviance is the least; the others are 10 and 23 standard deviations away.
  EXPECT_LT(posterior.ends(0, 0), 0.1);
  EXPECT_GT(posterior.ends(0, 1), 9);
  EXPECT_GT(posterior.ends.row(2).minCoeff(), 9);
}

}  // namespace
}  // namespace flash::sysid
