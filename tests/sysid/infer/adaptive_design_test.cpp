#include "sysid/infer/adaptive_design.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/sysid/short_lift.h"

namespace flash::sysid {
namespace {

const std::vector<Axis> kSearched = {parse_axis("young", "3:48:5:log"), parse_axis("friction", "0.1:0.5:5"),
                                     parse_axis("poisson", "0.3")};

TEST(Zoom, ExtentGrowsPastAnOpenEndWhereverTheEstimateStands) {
  GridVerdict verdict;
  for (int k = 0; k < 3; ++k) verdict.parameters.emplace_back();
  const Extent extent = {{6, 12}, {0.1, 0.2}, {0.3, 0.3}};
  const auto next = [&](double young, double friction) {
    verdict.parameters[0].estimate = young;
    verdict.parameters[0].interval95 = {7, 12};
    verdict.parameters[1].estimate = friction;
    verdict.parameters[1].interval95 = {0.1, 0.2};
    verdict.parameters[2].estimate = 0.3;
    verdict.parameters[2].interval95 = {0.3, 0.3};
    return next_extent(extent, verdict, kSearched);
  };
  for (const double young : {7.5, 8.5, 11.9}) EXPECT_GT(next(young, 0.15)[0][1], 12);
  for (const double friction : {0.1, 0.15, 0.2}) {
    const auto [low, high] = next(8, friction)[1];
    EXPECT_EQ(low, 0.1);  // the range ends there
    EXPECT_GT(high, 0.2);
  }
}

TEST(Zoom, ExtentsReachAMinimumFarOutside) {
  // A sharp minimum at 40: what is seen of it is its nearest point, with a narrow interval.
  Extent extent = {{3.5, 4}, {0.2, 0.2}, {0.3, 0.3}};
  const std::vector<Axis> searched = {kSearched[0], parse_axis("friction", "0.2"), kSearched[2]};
  GridVerdict verdict = {};
  for (int k = 0; k < 3; ++k) verdict.parameters.emplace_back();
  for (int round = 0; round < 16; ++round) {
    const auto [low, high] = extent[0];
    const double best = std::clamp(40.0, low, high);
    verdict.parameters[0].estimate = best;
    verdict.parameters[0].interval95 = {std::max(low, best - 0.01), std::min(high, best + 0.01)};
    for (const std::size_t k : {1U, 2U}) {
      verdict.parameters[k].estimate = extent[k][0];
      verdict.parameters[k].interval95 = {extent[k][0], extent[k][1]};
    }
    extent = next_extent(extent, verdict, searched);
  }
  EXPECT_LT(extent[0][0], 40);
  EXPECT_GT(extent[0][1], 40);
}

TEST(Lattice, HasValuesOfItsOwnWhereTheExtentIsNarrowerThanACellOfTheSearch) {
  const std::vector<Axis> axes = lattice({{4, 6.25}, {0.15, 0.35}, {0.3, 0.3}}, kSearched, 3);
  ASSERT_EQ(axes[0].values.size(), 3u);
  EXPECT_DOUBLE_EQ(axes[0].values[0], 4);
  EXPECT_DOUBLE_EQ(axes[0].values[1], 5);  // even in the logarithm
  EXPECT_DOUBLE_EQ(axes[0].values[2], 6.25);
  EXPECT_EQ(axes[1].values, kSearched[1].values);  // wider
  EXPECT_EQ(axes[2].values, kSearched[2].values);
}

GridVerdict verdict_of(const Extent& intervals) {
  GridVerdict verdict;
  for (const auto& [low, high] : intervals) {
    verdict.parameters.emplace_back();
    verdict.parameters.back().interval95 = {low, high};
    verdict.parameters.back().estimate = std::sqrt(low * high);
  }
  return verdict;
}

TEST(Lattice, StaysWhereIntervalsEndInsideOrWithTheRange) {
  const Extent extent = {{3, 9}, {0.15, 0.25}, {0.3, 0.3}};
  for (const Extent& inside :
       std::vector<Extent>{{{4, 8}, {0.16, 0.24}, {0.3, 0.3}}, {{3, 8}, {0.16, 0.24}, {0.3, 0.3}}})
    EXPECT_EQ(next_lattice(extent, extent, verdict_of(inside), kSearched), extent);
}

TEST(Lattice, GoesTwiceAsFarOnTheSideThatAnIntervalLeaves) {
  const Extent extent = {{3, 9}, {0.15, 0.25}, {0.3, 0.3}};
  const Extent up = next_lattice(extent, extent, verdict_of({{4, 9}, {0.18, 0.22}, {0.3, 0.3}}), kSearched);
  EXPECT_DOUBLE_EQ(up[0][1], 27);  // 9 times the extent's factor of 3
  EXPECT_LT(up[0][0], 4);
  EXPECT_LT(up[1][1], 0.5);
  const Extent down = next_lattice(extent, extent, verdict_of({{4, 8}, {0.15, 0.22}, {0.3, 0.3}}), kSearched);
  EXPECT_EQ(down[1][0], 0.1);  // the range ends there
}

TEST(Lattice, OneFarWiderThanTheAnswerNeedsIsSimulatedAgain) {
  const Extent extent = {{3, 9}, {0.15, 0.25}, {0.3, 0.3}}, needed = {{3, 9}, {0.19, 0.21}, {0.3, 0.3}};
  const Extent next =
      next_lattice(extent, needed, verdict_of({{4, 8}, {0.196, 0.204}, {0.3, 0.3}}), kSearched);
  EXPECT_GT(next[1][0], 0.18);
  EXPECT_LT(next[1][1], 0.22);
}

// Brute force: motions between the points of a lattice simulated. Vertices that touch the table a step
// earlier or later make steps of some hundredths of a millimetre, which no spline follows; on average they
// are few.
TEST(Lattice, MotionsBetweenItsPointsAreThoseSimulated) {
  const data::TemporaryFolder folder;
  const Replay replay = short_lift(folder, "sheet:0.2x0.05:0.0125");
  GridSettings grid;
  grid.base.material = short_lift_material();
  grid.axes = {parse_axis("bending", "5e-5:8e-4:5:log"), parse_axis("friction", "0.15:0.6:3:log")};
  const MotionStore store(folder / "rollouts");
  GridSettings local = grid;
  local.axes = lattice({{1.7e-4, 2.5e-4}, {0.25, 0.36}}, grid.axes, 3);
  const MotionInterpolant whole = *motion_interpolant(replay, grid, store),
                          near = *motion_interpolant(replay, local, store);
  double whole_off = 0, near_off = 0, count = 0;  // sums of squares [m^2]
  for (const double bending : {1.8e-4, 2.3e-4, 2.45e-4})
    for (const double friction : {0.26, 0.34}) {
      const Motion simulated = store.run(replay, candidate_at({bending, friction}, grid)).motion;
      const Motion far = whole.at({bending, friction}), close = near.at({bending, friction});
      for (std::size_t i = 0; i < close.positions.size(); ++i) {
        if (close.positions[i].rows() == 0) continue;
        whole_off += (far.positions[i] - simulated.positions[i]).squaredNorm();
        near_off += (close.positions[i] - simulated.positions[i]).squaredNorm();
        count += static_cast<double>(close.positions[i].rows());
      }
    }
  EXPECT_LT(std::sqrt(near_off / count), 1e-5);  // far below the 0.04 mm that a millimetre of noise leaves
  EXPECT_LT(near_off, whole_off / 4);
}

}  // namespace
}  // namespace flash::sysid
