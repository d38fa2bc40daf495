#include "sysid/infer/adaptive_design.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/sysid/short_lift.h"

namespace flash::sysid {
namespace {

const std::vector<Axis> kSearched = {parse_axis("young", "3:48:5:log"), parse_axis("friction", "0.1:0.5:5"),
                                     parse_axis("poisson", "0.3")};

/// Of a normal likelihood: centre and standard deviation in the coordinate of each axis.
Posterior posterior_of(const Extent& extent, const std::vector<std::array<double, 2>>& normal) {
  std::vector<Axis> axes = kSearched;
  for (std::size_t k = 0; k < axes.size(); ++k) {
    const auto [low, high] = extent[k];
    axes[k].values = {low};
    for (int i = 1; i <= 8 && low < high; ++i)
      axes[k].values.push_back(axes[k].logarithmic ? low * std::pow(high / low, i / 8.0)
                                                   : low + (high - low) * i / 8.0);
    axes[k].values.back() = high;
  }
  const std::vector<std::vector<double>> points = cartesian_product(axes);
  Eigen::VectorXd deviance = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(points.size()));
  for (std::size_t i = 0; i < points.size(); ++i)
    for (std::size_t k = 0; k < axes.size(); ++k)
      deviance[static_cast<Eigen::Index>(i)] +=
          std::pow((coordinate_of(axes[k], points[i][k]) - normal[k][0]) / normal[k][1], 2);
  return explore_posterior(axes, deviance);
}

TEST(NextExtent, GrowsPastAnOpenEndWhereverTheEstimateStands) {
  const Extent extent = {{6, 12}, {0.1, 0.2}, {0.3, 0.3}};
  for (const double young : {7.5, 8.5, 11.9, 14.0})
    EXPECT_GT(next_extent(extent, posterior_of(extent, {{{std::log(young), 0.4}, {0.15, 0.1}, {0.3, 1}}}),
                          kSearched)[0][1],
              12);
  for (const double friction : {0.1, 0.15, 0.2}) {
    const Extent next = next_extent(
        extent, posterior_of(extent, {{{std::log(8.0), 0.01}, {friction, 0.1}, {0.3, 1}}}), kSearched);
    EXPECT_EQ(next[1][0], 0.1);  // the range ends there
    EXPECT_GT(next[1][1], 0.2);
  }
}

TEST(NextExtent, ReachesAMinimumFarOutside) {
  Extent extent = {{3.5, 4}, {0.2, 0.2}, {0.3, 0.3}};
  const std::vector<Axis> searched = {kSearched[0], parse_axis("friction", "0.2"), kSearched[2]};
  int rounds = 0;
  for (; rounds < 12; ++rounds) {
    const Extent next =
        next_extent(extent, posterior_of(extent, {{{std::log(40.0), 0.01}, {0.2, 1}, {0.3, 1}}}), searched);
    if (next == extent) break;
    extent = next;
  }
  EXPECT_LT(rounds, 12);
  EXPECT_LT(extent[0][0], 40);
  EXPECT_GT(extent[0][1], 40);
  // Four standard deviations to both sides, up to half as many more.
  EXPECT_GT(std::log(extent[0][1] / extent[0][0]), 0.075);
  EXPECT_LT(std::log(extent[0][1] / extent[0][0]), 0.13);
}

TEST(Lattice, HasMoreValuesWhereTheExtentIsWiderThanACellOfTheSearch) {
  const std::vector<Axis> axes = lattice({{4, 6.25}, {0.15, 0.35}, {0.3, 0.3}}, kSearched, 3, 16);
  ASSERT_EQ(axes[0].values.size(), 3u);
  EXPECT_DOUBLE_EQ(axes[0].values[0], 4);
  EXPECT_DOUBLE_EQ(axes[0].values[1], 5);  // even in the logarithm
  EXPECT_DOUBLE_EQ(axes[0].values[2], 6.25);
  ASSERT_EQ(axes[1].values.size(), 5u);  // wider: five times three are no more than 16
  EXPECT_DOUBLE_EQ(axes[1].values[1], 0.2);
  EXPECT_EQ(axes[2].values, kSearched[2].values);
}

TEST(Lattice, StaysWhereNothingLikelyIsBeyondItOrTheRangeEnds) {
  const Extent extent = {{3, 9}, {0.15, 0.25}, {0.3, 0.3}};
  EXPECT_EQ(next_lattice(extent, posterior_of(extent, {{{std::log(5.2), 0.15}, {0.2, 0.0125}, {0.3, 1}}}),
                         kSearched),
            extent);
  EXPECT_EQ(next_lattice(extent, posterior_of(extent, {{{std::log(3.2), 0.2}, {0.2, 0.0125}, {0.3, 1}}}),
                         kSearched),
            extent);
}

TEST(Lattice, GoesTwiceAsFarOnTheSideThatThePosteriorLeaves) {
  const Extent extent = {{3, 9}, {0.15, 0.25}, {0.3, 0.3}};
  const Extent up =
      next_lattice(extent, posterior_of(extent, {{{std::log(8.0), 0.2}, {0.2, 0.01}, {0.3, 1}}}), kSearched);
  EXPECT_DOUBLE_EQ(up[0][1], 27);  // 9 times the extent's factor of 3
  EXPECT_LT(up[1][1], 0.5);
  const Extent down = next_lattice(
      extent, posterior_of(extent, {{{std::log(5.2), 0.15}, {0.16, 0.01}, {0.3, 1}}}), kSearched);
  EXPECT_EQ(down[1][0], 0.1);  // the range ends there
}

TEST(Lattice, OneFarWiderThanTheAnswerNeedsIsSimulatedAgain) {
  const Extent extent = {{3, 9}, {0.15, 0.25}, {0.3, 0.3}}, looked = {{3, 9}, {0.19, 0.21}, {0.3, 0.3}};
  const Extent next = next_lattice(
      extent, posterior_of(looked, {{{std::log(5.2), 0.15}, {0.2, 0.002}, {0.3, 1}}}), kSearched);
  EXPECT_GT(next[1][0], 0.18);
  EXPECT_LT(next[1][1], 0.22);
}

// Brute force: motions between the points of a lattice simulated. Vertices that touch the table a step
// earlier or later make steps of some hundredths of a millimetre, which no spline follows; on average they
// are few.
TEST(Lattice, MotionsBetweenItsPointsAreThoseSimulated) {
  const data::TemporaryFolder folder;
  const Replay replay = short_lift(folder, "sheet:0.2x0.05:0.0125:alternating");
  GridSettings grid;
  grid.base.material = short_lift_material();
  grid.axes = {parse_axis("bending", "5e-5:8e-4:5:log"), parse_axis("friction", "0.15:0.6:3:log")};
  const MotionStore store(folder / "rollouts");
  GridSettings local = grid;
  local.axes = lattice({{1.7e-4, 2.5e-4}, {0.25, 0.36}}, grid.axes, 3, 30);
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

TEST(AdaptiveDesign, ALatticeIsFinerByHalfOfACellInAnyDirection) {
  const std::vector<Axis> searched = {parse_axis("bending", "1e-5:1e-3:5:log"),
                                      parse_axis("start_yaw", "0:1:5")};
  std::vector<Axis> other = searched;
  EXPECT_FALSE(is_finer(other, searched));
  other[1] = parse_axis("start_yaw", "0:1:8");
  EXPECT_FALSE(is_finer(other, searched));  // 4 / 7 of a cell
  EXPECT_TRUE(is_finer(other, searched, 0.6));
  other[1] = parse_axis("start_yaw", "0:1:9");
  EXPECT_TRUE(is_finer(other, searched));
}

}  // namespace
}  // namespace flash::sysid
