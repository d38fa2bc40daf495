#include "sysid/infer/modes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <random>

namespace flash::sysid {
namespace {

constexpr double kFloor = 1e-3;  // m

/// Of one keyframe; `excess`: of the squared score over that of the floor, in floors.
GridResults map_of(const std::vector<Axis>& axes,
                   const std::function<double(const std::vector<double>&)>& excess) {
  GridResults results{axes, {"lift"}, {}};
  for (const std::vector<double>& values : cartesian_product(axes)) {
    CandidateResult candidate;
    candidate.id = static_cast<int>(results.candidates.size());
    candidate.values = values;
    candidate.score = kFloor * std::sqrt(1 + excess(values));
    candidate.recordings.push_back({candidate.score, {}, 0, 0, {}, {{0, candidate.score, 100, 1}}});
    results.candidates.push_back(candidate);
  }
  return results;
}

Axis evenly(const std::string& name, int count) { return parse_axis(name, "0:1:" + std::to_string(count)); }

/// Squared distance in widths.
double bowl(const std::vector<double>& x, double a, double b, double width) {
  return (std::pow(x[0] - a, 2) + std::pow(x[1] - b, 2)) / (width * width);
}

TEST(SeparateRegions, TwoBowlsAreTwoAndTheBetterComesFirst) {
  const GridResults results = map_of({evenly("friction", 11), evenly("grasp_pitch", 11)}, [](const auto& x) {
    return std::min(bowl(x, 0.2, 0.3, 0.1) + 0.05, bowl(x, 0.8, 0.7, 0.1));
  });
  const std::vector<std::size_t> regions = separate_modes(results, kFloor * std::sqrt(1.5));
  ASSERT_EQ(regions.size(), 2u);
  EXPECT_EQ(results.candidates[regions[0]].values, (std::vector<double>{0.8, 0.7}));
  EXPECT_EQ(results.candidates[regions[1]].values, (std::vector<double>{0.2, 0.3}));
  const std::string warning = warning_of_modes(results, kFloor * std::sqrt(1.5));
  EXPECT_NE(warning.find("2 separate parts: friction 0.2, grasp_pitch 0.3 scores 1.025 mm against 1 mm"),
            std::string::npos)
      << warning;
  EXPECT_NE(warning.find("fit --global"), std::string::npos);

  // The same basins, of which one is outside the region.
  EXPECT_EQ(separate_modes(results, kFloor * std::sqrt(1.04)).size(), 1u);
  EXPECT_EQ(warning_of_modes(results, kFloor * std::sqrt(1.04)), "");
  EXPECT_TRUE(separate_modes(results, 0.9 * kFloor).empty());
}

TEST(SeparateRegions, AStraightValleyOfAnyWidthAndSlopeIsOne) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> share(0, 1);
  int islands = 0;
  for (int i = 0; i < 200; ++i) {
    // 0.02 to 0.2 wide, in cells of 0.1, and ten times as long.
    const double width = 0.02 * std::pow(10, share(random)), angle = std::numbers::pi * share(random);
    const double a = share(random), b = share(random);
    const auto excess = [&](const std::vector<double>& x) {
      const double u = std::cos(angle) * (x[0] - a) + std::sin(angle) * (x[1] - b);
      const double v = std::cos(angle) * (x[1] - b) - std::sin(angle) * (x[0] - a);
      return std::pow(v / width, 2) + std::pow(u / (10 * width), 2);
    };
    const GridResults results = map_of({evenly("friction", 11), evenly("grasp_pitch", 11)}, excess);
    double least = std::numeric_limits<double>::infinity();
    for (const CandidateResult& candidate : results.candidates) least = std::min(least, candidate.score);
    EXPECT_EQ(separate_modes(results, std::hypot(least, kFloor)).size(), 1u)
        << width << " " << angle << " " << a << " " << b;
    // How many candidates stand alone: the case is not an empty one.
    std::size_t alone = 0, inside = 0;
    for (std::size_t p = 0; p < 121; ++p) {
      if (results.candidates[p].score >= std::hypot(least, kFloor)) continue;
      ++inside;
      bool neighbour = false;
      for (std::size_t q = 0; q < 121; ++q)
        neighbour = neighbour || (p != q && results.candidates[q].score < std::hypot(least, kFloor) &&
                                  std::abs(static_cast<int>(p / 11) - static_cast<int>(q / 11)) <= 1 &&
                                  std::abs(static_cast<int>(p % 11) - static_cast<int>(q % 11)) <= 1);
      alone += !neighbour;
    }
    islands += alone > 0 && inside > 1;
  }
  EXPECT_GT(islands, 10);
}

TEST(SeparateRegions, WhatDivergesSeparates) {
  const auto wall = [](const std::vector<double>& x) {
    return x[0] > 0.25 && x[0] < 0.75 ? std::numeric_limits<double>::infinity() : 4 * x[1] + 0.2 * x[0];
  };
  const GridResults results = map_of({evenly("friction", 11), evenly("grasp_pitch", 4)}, wall);
  EXPECT_EQ(separate_modes(results, kFloor * std::sqrt(1.5)).size(), 2u);
}

TEST(SeparateRegions, OneValueOfAParameterIsNoDirection) {
  const auto two = [](const std::vector<double>& x) {
    return 8 * std::pow(std::sin(2 * std::numbers::pi * (x[1] - 0.25)), 2) + 0.01 * x[1];
  };
  const GridResults results = map_of({parse_axis("friction", "0.3"), evenly("grasp_pitch", 13)}, two);
  EXPECT_EQ(separate_modes(results, kFloor * std::sqrt(1.5)).size(), 2u);
}

}  // namespace
}  // namespace flash::sysid
