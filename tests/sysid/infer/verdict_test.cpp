#include "sysid/infer/verdict.h"

#include <gtest/gtest.h>

#include <cmath>

namespace flash::sysid {
namespace {

GridResults searched(const std::string& range) {
  GridResults results;
  results.axes = {parse_axis("bending", range)};
  for (const double value : results.axes[0].values) {
    results.candidates.emplace_back();
    results.candidates.back().values = {value};
    results.candidates.back().score = 1e-3;
  }
  return results;
}

/// A normal posterior of log(bending), searched over a range; `sd` of the logarithm.
ParameterFinding bending_found(const std::string& range, double at, double sd) {
  const GridResults results = searched(range);
  const std::vector<Axis> axes = in_own_coordinates(results.axes);
  std::vector<Axis> fine = axes;
  fine[0].values.clear();
  constexpr int kPoints = 81;
  const double low = std::log(axes[0].values.front()), high = std::log(axes[0].values.back());
  Eigen::VectorXd deviance(kPoints);
  for (int i = 0; i < kPoints; ++i) {
    const double x = low + (high - low) * i / (kPoints - 1);
    fine[0].values.push_back(std::exp(x));
    deviance[i] = std::pow((x - std::log(at)) / sd, 2);
  }
  return findings_of(results, axes, explore_posterior(fine, deviance)).front();
}

TEST(Verdict, IsTheSameWhateverRangeWasTypedAndHowItWasListed) {
  const ParameterFinding listed = bending_found("2e-5,1e-4,5e-4", 1e-4, 0.1);
  const ParameterFinding wide = bending_found("1e-6:1e-2:9:log", 1e-4, 0.1);
  for (const ParameterFinding& found : {listed, wide}) {
    EXPECT_EQ(found.identifiable, Identifiable::yes);
    EXPECT_NEAR(*found.estimate, 1e-4, 1e-6);
    // 1.96 sd to both sides; 12,800 draws worth 1,600 tell a quantile to 0.07 sd.
    EXPECT_NEAR(std::log((*found.interval95)[0] / 1e-4), -0.196, 0.02);
    EXPECT_NEAR(std::log((*found.interval95)[1] / 1e-4), 0.196, 0.02);
    EXPECT_NEAR(*found.bits, std::log2(std::log(100) / (2 * 0.196)), 0.15);
  }
}

TEST(Verdict, TheEndsOfARangeTellNothing) {
  // Flat over the range: nothing is told, however narrow the range is.
  const ParameterFinding narrow = bending_found("0.9e-4:1.1e-4:3:log", 1e-4, 1);
  EXPECT_EQ(narrow.identifiable, Identifiable::no);
  EXPECT_LE(*narrow.bits, 0);
  // The best value is the lowest searched: the side below is open, and the estimate is inside its interval.
  const ParameterFinding edge = bending_found("2e-6:2e-4:5:log", 1e-6, 0.5);
  EXPECT_EQ(edge.identifiable, Identifiable::upper_bound);
  EXPECT_EQ(edge.edge, RangeEdge::low);
  EXPECT_NE(edge.note.find("search lower"), std::string::npos);
  EXPECT_NEAR((*edge.interval95)[0], *edge.estimate, 1e-9 * *edge.estimate);  // exp(log(x))
}

// Bending is usually 1.1e-6 to 1.1e-4 N m: that it is at most 2e-4 is known beforehand.
TEST(Verdict, ABoundThatGainsLessThanOneBitIsNotTold) {
  const ParameterFinding found = bending_found("1e-4:1e-2:5:log", 0.5e-4, 0.5);
  EXPECT_LT(*found.bits, 1);
  EXPECT_EQ(found.identifiable, Identifiable::no);
  EXPECT_EQ(found.edge, RangeEdge::low);  // lower values are still worth a search
  // Where every value is likely a wider range would tell no more.
  EXPECT_EQ(bending_found("0.9e-4:1.1e-4:3:log", 1.1e-4, 1).edge, RangeEdge::none);
}

/// What a posterior tells that is narrow about 6.4e-5, where motions change too abruptly between the values
/// of a range.
ParameterFinding found_by_points(const std::string& range) {
  const GridResults results = searched(range);
  const std::vector<Axis> axes = in_own_coordinates(results.axes);
  std::vector<Axis> fine = axes;
  fine[0].values.clear();
  Eigen::VectorXd deviance(17);
  for (int i = 0; i < 17; ++i) {
    fine[0].values.push_back(6.4e-5 * std::exp(0.01 * (i - 8)));
    deviance[i] = std::pow((i - 8) / 2.0, 2);
  }
  return findings_of(results, axes, up_to_neighbours(explore_posterior(fine, deviance), axes)).front();
}

// An interval of 4 % about one branch of a motion that jumps would not hold a truth on the other.
TEST(Verdict, OfAbruptMotionsIsWhatTheSearchedValuesTell) {
  const ParameterFinding found = found_by_points("3e-5:1e-3:9:log");
  const std::vector<double> values = parse_axis("bending", "3e-5:1e-3:9:log").values;
  EXPECT_NEAR((*found.interval95)[0], values[1], 1e-9 * values[1]);  // 4.65e-5
  EXPECT_NEAR((*found.interval95)[1], values[2], 1e-9 * values[2]);  // 7.21e-5
  EXPECT_EQ(found.identifiable, Identifiable::yes);
  // The usual range, two powers of ten, over an eighth of the searched one.
  EXPECT_NEAR(*found.bits, std::log2(std::log(100) / (std::log(1e-3 / 3e-5) / 8)), 1e-6);
  // A cell of half of what is usual, or more, is not told.
  const ParameterFinding coarse = found_by_points("5e-6:2e-4:2:log");
  EXPECT_LT(*coarse.bits, 1);
  EXPECT_EQ(coarse.identifiable, Identifiable::no);
}

TEST(Verdict, AnEstimateBeyondTheQuantilesIsInsideItsInterval) {
  // A posterior that falls from its end steeply: its mode is there, its 2.5 % quantile is not.
  const GridResults results = searched("1e-5:1e-3:5:log");
  std::vector<Axis> inner = results.axes;
  inner[0].values = {9e-5, 1e-4, 1.1e-4, 1.2e-4, 1.3e-4};
  Posterior posterior = explore_posterior(inner, Eigen::VectorXd::LinSpaced(5, 0, 8));
  const ParameterFinding found = findings_of(results, results.axes, posterior).front();
  EXPECT_LE((*found.interval95)[0], *found.estimate);
  EXPECT_GE((*found.interval95)[1], *found.estimate);
}

}  // namespace
}  // namespace flash::sysid
