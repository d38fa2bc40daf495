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
  return findings_of(results, axes, explore_posterior(fine, deviance), {}).front();
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

/// A normal posterior of a parameter, whose middle and width are shares of what is searched, over that range.
ParameterFinding found_of(const std::string& name, std::array<double, 2> range, double at, double sd,
                          const MaterialBase& base) {
  GridResults results;
  results.axes = {{name, {range[0], range[1]}, false}};
  std::vector<Axis> axes = in_own_coordinates(results.axes);
  for (const double value : range) {
    results.candidates.emplace_back();
    results.candidates.back().values = {value};
    results.candidates.back().score = 1e-3;
  }
  std::vector<Axis> fine = axes;
  fine[0].values.clear();
  constexpr int kPoints = 161;
  const double low = coordinate_of(axes[0], range[0]), high = coordinate_of(axes[0], range[1]);
  Eigen::VectorXd deviance(kPoints);
  for (int i = 0; i < kPoints; ++i) {
    const double x = low + (high - low) * i / (kPoints - 1);
    fine[0].values.push_back(value_of(axes[0], x));
    deviance[i] = std::pow((x - at) / sd, 2);
  }
  return findings_of(results, axes, explore_posterior(fine, deviance), base).front();
}

TEST(Verdict, IsTheSameOfEveryParameterWhateverRangeWasTyped) {
  MaterialBase sheet, thick, solid;
  thick.thickness = 5e-4;
  solid.solid = data::SolidMaterial{};
  for (const MaterialBase& base : {sheet, thick, solid})
    for (const Parameter& parameter : known_parameters()) {
      if (!is_of(parameter, base)) continue;
      const auto [low, high] = usual_range(parameter, base);
      const Axis axis = in_own_coordinates({{parameter.name, {low, high}, false}}).front();
      const double first = coordinate_of(axis, low), width = coordinate_of(axis, high) - first;
      const double at = first + 0.5 * width;
      const auto over = [&](double share) {  // a range of this share of the usual about its middle
        Axis wide = axis;
        wide.values = {parameter.low, parameter.high};
        const std::array<double, 2> range = {value_of(wide, at - 0.5 * share * width),
                                             value_of(wide, at + 0.5 * share * width)};
        return found_of(parameter.name, range, at, width / 30, base);
      };
      const ParameterFinding narrow = over(0.6), wide = over(1);
      EXPECT_EQ(narrow.identifiable, Identifiable::yes) << parameter.name;
      EXPECT_EQ(wide.identifiable, Identifiable::yes) << parameter.name;
      // Four standard deviations of thirty; draws tell a quantile to 0.07 of one.
      EXPECT_NEAR(*narrow.bits, std::log2(30 / (2 * 1.96)), 0.15) << parameter.name;
      EXPECT_NEAR(*wide.bits, *narrow.bits, 0.15) << parameter.name;
    }
}

// The same draws in both units, to the rounding of logarithms up to 20.
TEST(Verdict, OfAMembraneIsTheSameAsModulusAndAsStiffness) {
  constexpr double kThickness = 5e-4, kRounding = 1e-12;
  MaterialBase sheet, thick;
  thick.thickness = kThickness;
  const auto axis = [](double unit) {
    return in_own_coordinates({{"young", {5 * unit, 100 * unit, 3000 * unit}, false}});
  };
  for (const double falls : {1.0, 20.0, 200.0}) {  // of the deviance, from the middle to both ends
    const Posterior stiffness = explore_posterior(axis(1), Eigen::Vector3d(falls, 0, falls));
    Posterior modulus = stiffness;
    modulus.axes = axis(1 / kThickness);
    modulus.samples.array() -= std::log(kThickness);
    modulus.estimate.array() -= std::log(kThickness);
    const auto found = [&](const Posterior& posterior, const MaterialBase& base) {
      GridResults results;
      results.axes = posterior.axes;
      for (const double value : results.axes[0].values) {
        results.candidates.emplace_back();
        results.candidates.back().values = {value};
        results.candidates.back().score = 1e-3;
      }
      return findings_of(results, results.axes, posterior, base).front();
    };
    const ParameterFinding as_stiffness = found(stiffness, sheet), as_modulus = found(modulus, thick);
    EXPECT_EQ(as_stiffness.identifiable, as_modulus.identifiable) << falls;
    EXPECT_NEAR(*as_stiffness.bits, *as_modulus.bits, kRounding) << falls;
    for (const std::size_t side : {0, 1}) {
      const double end = (*as_stiffness.interval95)[side];
      EXPECT_NEAR(end, (*as_modulus.interval95)[side] * kThickness, kRounding * end) << falls;
    }
  }
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
  return findings_of(results, axes, up_to_neighbours(explore_posterior(fine, deviance), axes), {}).front();
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
  // Where all of a range is likely, it tells nothing, however narrow it is.
  EXPECT_EQ(found_by_points("5e-5:8e-5:2:log").identifiable, Identifiable::no);
}

TEST(Verdict, AnEstimateBeyondTheQuantilesIsInsideItsInterval) {
  // A posterior that falls from its end steeply: its mode is there, its 2.5 % quantile is not.
  const GridResults results = searched("1e-5:1e-3:5:log");
  std::vector<Axis> inner = results.axes;
  inner[0].values = {9e-5, 1e-4, 1.1e-4, 1.2e-4, 1.3e-4};
  Posterior posterior = explore_posterior(inner, Eigen::VectorXd::LinSpaced(5, 0, 8));
  const ParameterFinding found = findings_of(results, results.axes, posterior, {}).front();
  EXPECT_LE((*found.interval95)[0], *found.estimate);
  EXPECT_GE((*found.interval95)[1], *found.estimate);
}

}  // namespace
}  // namespace flash::sysid
