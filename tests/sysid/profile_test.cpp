#include "sysid/profile.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

namespace flash::sysid {
namespace {

/// A grid whose squared score is a function of the parameters; 20 keyframes.
GridResults grid_of(const std::vector<Axis>& axes,
                    const std::function<double(const std::vector<double>&)>& squared) {
  GridResults results{axes, {"lift"}, {}};
  for (const std::vector<double>& values : cartesian_product(axes)) {
    CandidateResult result;
    result.id = static_cast<int>(results.candidates.size());
    result.values = values;
    result.score = std::sqrt(squared(values));
    result.converged = true;
    result.recordings.resize(1);
    result.recordings[0].keyframes.assign(20, {0, result.score, 100, 1});
    result.recordings[0].keyframes.push_back({9, 0, 100, 0});  // no weight: not a sample
    results.candidates.push_back(result);
  }
  return results;
}

constexpr double kFloor = 0.005;  // m

TEST(Profile, IntervalOfAParaboloidIsThatOfTheGaussianItStandsFor) {
  // s^2 = s0^2 (1 + x^T P x / n) gives chi^2 = x^T P x, covariance P^-1, x = log(p / truth).
  const Axis young = parse_axis("young", "1:1e4:41:log"), bending = parse_axis("bending", "1e-6:1e-2:41:log");
  const double a = 8, b = 12, c = 5;
  const auto squared = [&](const std::vector<double>& v) {
    const double x = std::log(v[0] / 100), y = std::log(v[1] / 1.2e-4);
    return kFloor * kFloor * (1 + (a * x * x + b * y * y + 2 * c * x * y) / 20);
  };
  const GridVerdict verdict = profile_grid(grid_of({young, bending}, squared));
  EXPECT_EQ(verdict.keyframes, 20);
  EXPECT_EQ(verdict.sigma_source, "residual");
  const Eigen::Matrix2d covariance = (Eigen::Matrix2d() << a, c, c, b).finished().inverse();
  for (int k = 0; k < 2; ++k) {
    const ParameterFinding& finding = verdict.parameters[k];
    const double truth = k == 0 ? 100 : 1.2e-4, half = 1.96 * std::sqrt(covariance(k, k));
    EXPECT_EQ(finding.identifiable, Identifiable::yes);
    EXPECT_EQ(finding.edge, RangeEdge::none);
    // Grid step 0.23 in the logarithm: chords of the parabola and the other axis' grid cost a tenth of it.
    EXPECT_NEAR(std::log(*finding.estimate / truth), 0, 0.03);
    EXPECT_NEAR(std::log((*finding.interval95)[0] / truth), -half, 0.06);
    EXPECT_NEAR(std::log((*finding.interval95)[1] / truth), half, 0.06);
  }
  ASSERT_EQ(verdict.covariance_log.rows(), 2);
  // The grid's best is not the truth itself: chi^2 is measured from it, which scales the paraboloid by under
  // 2 %.
  EXPECT_NEAR((verdict.covariance_log - covariance).norm(), 0, 0.03 * covariance.norm());
}

TEST(Profile, FlatOneSidedAndEdgeAreSaid) {
  const Axis poisson = parse_axis("poisson", "0:0.4:5"), friction = parse_axis("friction", "0.1:1:10"),
             bending = parse_axis("bending", "1e-6:1e-3:7:log"), young = parse_axis("young", "1:1e3:7:log");
  const auto squared = [&](const std::vector<double>& v) {
    double rise = 1e-3 * v[0];                                  // flat
    rise += std::pow(std::max(0.0, 0.5 - v[1]) / 0.1, 2);       // only small friction is excluded
    rise += std::pow(std::max(0.0, std::log(v[2] / 1e-5)), 2);  // only large bending is excluded
    rise += std::pow(std::log(v[3] / 1e5), 2);                  // the best lies beyond the range
    return kFloor * kFloor * (1 + rise);
  };
  const GridVerdict verdict = profile_grid(grid_of({poisson, friction, bending, young}, squared));
  EXPECT_EQ(verdict.parameters[0].identifiable, Identifiable::no);
  EXPECT_NE(verdict.parameters[0].note.find("not identifiable"), std::string::npos);
  EXPECT_EQ(verdict.parameters[1].identifiable, Identifiable::lower_bound);
  EXPECT_LT((*verdict.parameters[1].interval95)[0], 0.5);
  EXPECT_EQ((*verdict.parameters[1].interval95)[1], 1);
  EXPECT_EQ(verdict.parameters[2].identifiable, Identifiable::upper_bound);
  EXPECT_EQ(verdict.parameters[3].identifiable, Identifiable::lower_bound);
  EXPECT_EQ(verdict.parameters[3].edge, RangeEdge::high);
}

TEST(Profile, RepeatabilityAboveTheResidualWidensTheInterval) {
  const Axis bending = parse_axis("bending", "1e-6:1e-3:31:log");
  const auto squared = [](const std::vector<double>& v) {
    return kFloor * kFloor * (1 + std::pow(std::log(v[0] / 3e-5), 2));
  };
  const GridResults results = grid_of({bending}, squared);
  const auto width = [&](std::optional<double> repeatability) {
    const auto interval = *profile_grid(results, repeatability).parameters[0].interval95;
    return std::log(interval[1] / interval[0]);
  };
  EXPECT_NEAR(width(0.010) / width({}), 2, 0.02);  // sigma is twice the residual; 1 % of a cell a side
  EXPECT_EQ(width(0.001), width({}));
  EXPECT_EQ(profile_grid(results, 0.010).sigma_source, "repeatability");
}

TEST(Profile, WithoutAUsableCandidateThereIsNoVerdict) {
  const auto none = [](const std::vector<double>&) { return std::numeric_limits<double>::infinity(); };
  EXPECT_EQ(profile_grid(grid_of({parse_axis("young", "1,2")}, none)).best, -1);
}

}  // namespace
}  // namespace flash::sysid
