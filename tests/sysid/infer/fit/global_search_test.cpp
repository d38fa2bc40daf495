#include "sysid/infer/fit/global_search.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace flash::sysid {
namespace {

const Eigen::Vector2d kLow(-4, -1), kHigh(3, 1);

/// A wide shallow basin about (1.5, 0.3) and a deep narrow one about (-2.6, -0.5): half a unit wide along x,
/// a fourteenth of the range.
double two_basins(const Eigen::VectorXd& x) {
  const double wide = 1 - std::exp(-0.5 * (std::pow((x[0] - 1.5) / 1.5, 2) + std::pow(x[1] - 0.3, 2)));
  const double deep = std::exp(-0.5 * (std::pow((x[0] + 2.6) / 0.5, 2) + std::pow((x[1] + 0.5) / 0.4, 2)));
  return 10 * wide - 15 * deep;
}

BatchCost batch_of(double (*cost)(const Eigen::VectorXd&)) {
  return [cost](const std::vector<Eigen::VectorXd>& points) {
    std::vector<double> costs;
    for (const Eigen::VectorXd& point : points) costs.push_back(cost(point));
    return costs;
  };
}

Generation best_of(const std::vector<Generation>& generations) {
  Generation best;
  for (const Generation& generation : generations)
    if (generation.improved) best = generation;
  return best;
}

TEST(GlobalSearch, LeavesTheBasinOfItsStartForTheDeeperOne) {
  constexpr int kSteps = 400;
  const Eigen::Vector2d start(1.5, 0.3);
  Eigen::Vector2d least = kLow;
  int below_start = 0;
  for (int i = 0; i <= kSteps; ++i)
    for (int j = 0; j <= kSteps; ++j) {
      const Eigen::Vector2d x =
          kLow + (kHigh - kLow).cwiseProduct(Eigen::Vector2d(i, j) / static_cast<double>(kSteps));
      if (two_basins(x) < two_basins(least)) least = x;
      below_start += two_basins(x) < two_basins(start);
    }
  ASSERT_LT(least[0], -2);  // the oracle itself: not where the start lies
  // Of what is below the start (3.5 % of the box) one point has to be met, by 95 drawn: 1 - 0.965^95 = 97 %.
  EXPECT_NEAR(below_start / std::pow(kSteps + 1, 2), 0.035, 0.005);
  int right = 0;
  for (unsigned seed = 1; seed <= 20; ++seed) {
    const std::vector<Generation> path =
        global_search(batch_of(two_basins), kLow, kHigh, start, {12, 16, seed});
    ASSERT_EQ(path.size(), 12u);
    // One spread of the deep basin: from there a descent stays in it.
    right += ((best_of(path).point - least).cwiseAbs().array() < Eigen::Array2d(0.5, 0.4)).all();
  }
  EXPECT_GE(right, 17);  // four misses of 20 at 3 % each: 0.3 %
}

TEST(GlobalSearch, IsTheSameForTheSameSeedAndAnotherForAnother) {
  const auto path = [](unsigned seed) {
    return global_search(batch_of(two_basins), kLow, kHigh, Eigen::Vector2d(1.5, 0.3), {6, 8, seed});
  };
  const std::vector<Generation> one = path(7), again = path(7), other = path(8);
  bool differs = false;
  for (std::size_t i = 0; i < one.size(); ++i) {
    EXPECT_EQ(one[i].point, again[i].point);
    EXPECT_EQ(one[i].cost, again[i].cost);
    differs = differs || one[i].point != other[i].point;
  }
  EXPECT_TRUE(differs);
}

TEST(GlobalSearch, EvaluatesWholeGenerationsInsideTheBoxAndReportsThem) {
  // Falls towards a corner, so that the swarm presses against the box.
  std::vector<std::size_t> sizes;
  double lowest = std::numeric_limits<double>::infinity();
  const BatchCost cost = [&](const std::vector<Eigen::VectorXd>& points) {
    std::vector<double> costs;
    sizes.push_back(points.size());
    for (const Eigen::VectorXd& point : points) {
      EXPECT_TRUE((point.array() >= kLow.array()).all() && (point.array() <= kHigh.array()).all());
      costs.push_back(point.sum());
      lowest = std::min(lowest, costs.back());
    }
    return costs;
  };
  int reported = 0;
  const std::vector<Generation> path = global_search(cost, kLow, kHigh, Eigen::Vector2d(9, 9), {10, 12, 3},
                                                     [&](const Generation&) { ++reported; });
  EXPECT_EQ(sizes, std::vector<std::size_t>(10, 12));
  EXPECT_EQ(reported, 10);
  EXPECT_EQ(best_of(path).cost, lowest);
  double before = std::numeric_limits<double>::infinity();
  for (const Generation& generation : path) {
    EXPECT_EQ(generation.improved, generation.cost < before);
    before = std::min(before, generation.cost);
  }
}

TEST(GlobalSearch, GoesRoundWhatHasNoCost) {
  // Two thirds of the box diverge; the rest falls towards their border.
  const auto cost = [](const Eigen::VectorXd& x) {
    if (x[0] > 1.5) return std::numeric_limits<double>::quiet_NaN();
    return x[0] > -1.6 ? std::numeric_limits<double>::infinity() : std::pow(x[0] + 2, 2) + x[1] * x[1];
  };
  const std::vector<Generation> path =
      global_search(batch_of(cost), kLow, kHigh, Eigen::Vector2d(2, 0), {12, 16, 5});
  EXPECT_LT(best_of(path).cost, 0.1);

  const auto nowhere = [](const Eigen::VectorXd&) { return std::numeric_limits<double>::quiet_NaN(); };
  for (const Generation& generation :
       global_search(batch_of(nowhere), kLow, kHigh, Eigen::Vector2d(0, 0), {4, 8, 5})) {
    EXPECT_TRUE(std::isinf(generation.cost));
    EXPECT_FALSE(generation.improved);
  }
}

TEST(GlobalSearch, IsNeverWorseThanItsStart) {
  const Eigen::Vector2d minimum(-2.6, -0.5);
  for (unsigned seed = 1; seed <= 5; ++seed)
    EXPECT_LE(best_of(global_search(batch_of(two_basins), kLow, kHigh, minimum, {1, 4, seed})).cost,
              two_basins(minimum));
  EXPECT_TRUE(global_search(batch_of(two_basins), kLow, kHigh, minimum, {}).empty());
}

}  // namespace
}  // namespace flash::sysid
