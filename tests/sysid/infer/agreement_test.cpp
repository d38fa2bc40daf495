#include "sysid/infer/agreement.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace flash::sysid {
namespace {

std::vector<Axis> one_axis() {
  Axis axis{"bending", {}, true};
  for (int i = -40; i <= 40; ++i) axis.values.push_back(1e-4 * std::exp(0.1 * i));
  return {axis};
}

/// Of recordings that know the logarithm to these standard deviations, about these values.
Eigen::MatrixXd parabolas(const std::vector<Axis>& axes, const std::vector<double>& centres,
                          const std::vector<double>& spreads) {
  Eigen::MatrixXd deviances(axes[0].values.size(), centres.size());
  for (Eigen::Index i = 0; i < deviances.rows(); ++i)
    for (Eigen::Index r = 0; r < deviances.cols(); ++r) {
      const auto at = static_cast<std::size_t>(r);
      const double x = std::log(axes[0].values[static_cast<std::size_t>(i)] / 1e-4);
      deviances(i, r) = std::pow((x - centres[at]) / spreads[at], 2);
    }
  return deviances;
}

TEST(Agreement, TheExcessOfTwoMeasurementsIsTheirDistanceOverItsSpread) {
  const std::vector<Axis> axes = one_axis();
  const Agreement agreement = agreement_of(axes, parabolas(axes, {-1, 1}, {0.6, 0.8}));
  EXPECT_NEAR(agreement.excess, 4 / (0.6 * 0.6 + 0.8 * 0.8), 0.02);  // points a tenth apart
  EXPECT_NEAR(agreement.chance, std::erfc(2 / std::sqrt(2.0)), 0.001);
  EXPECT_NEAR(agreement.alone[0][0], 1e-4 * std::exp(-1), 1e-12);
  EXPECT_NEAR(agreement.alone[1][0], 1e-4 * std::exp(1), 1e-12);
  EXPECT_EQ(contradiction_text(agreement, axes, {"a", "b"}), "");
}

TEST(Agreement, NamesWhatEachAsksForWhereChanceDoesNotExplainIt) {
  const std::vector<Axis> axes = one_axis();
  const Agreement agreement = agreement_of(axes, parabolas(axes, {-1, 9}, {0.5, 0.5}));
  const std::string text = contradiction_text(agreement, axes, {"lift", "fold"});
  EXPECT_NE(text.find("lift asks for bending 3.679e-05, fold asks for bending at least 0.00546"),
            std::string::npos)
      << text;
}

// Chi-square of the degrees of freedom that are stated: as many are told as chance allows.
TEST(Agreement, RecordingsOfOneClothContradictEachOtherAsOftenAsStated) {
  const std::vector<Axis> axes = one_axis();
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal;
  for (const std::size_t recordings : {2, 3, 5}) {
    int below = 0;
    for (int trial = 0; trial < 1000; ++trial) {
      std::vector<double> centres(recordings);
      for (double& centre : centres) centre = 0.5 * normal(random);
      const std::vector<double> spreads(recordings, 0.5);
      below += agreement_of(axes, parabolas(axes, centres, spreads)).chance < 0.1 ? 1 : 0;
    }
    EXPECT_NEAR(below, 100, 3 * std::sqrt(1000 * 0.1 * 0.9)) << recordings;
  }
}

}  // namespace
}  // namespace flash::sysid
