#include "calib/detect/dot_lattice.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <random>

namespace flash::calib {
namespace {

/// A grid of 7 x 5 dots, turned in the picture and slanted, its rows narrower by half at one end.
std::vector<Eigen::Vector2d> slanted(double turn) {
  std::vector<Eigen::Vector2d> places;
  for (int r = 0; r < 5; ++r)
    for (int c = 0; c < 7; ++c) {
      const double depth = 1 + 0.12 * c + 0.05 * r;
      places.emplace_back(Eigen::Rotation2Dd(turn) * Eigen::Vector2d(60.0 * c, 40.0 * r) / depth);
      places.back() += Eigen::Vector2d(400, 300);
    }
  return places;
}

TEST(DotLattice, IsFoundHoweverItIsTurnedAmongOtherDots) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> beside(-300, 1100);
  for (double turn = 0; turn < 6.3; turn += 0.35) {
    const std::vector<Eigen::Vector2d> grid = slanted(turn);
    std::vector<Eigen::Vector2d> all = grid;
    while (all.size() < 60) {  // none within the grid, or where it would go on
      const Eigen::Vector2d place(beside(random), beside(random));
      const auto near = [&](const Eigen::Vector2d& dot) { return (dot - place).norm() < 100; };
      if (std::none_of(grid.begin(), grid.end(), near)) all.push_back(place);
    }
    std::shuffle(all.begin(), all.end(), random);
    const std::vector<std::size_t> found = dot_lattice(all, 7, 5);
    ASSERT_EQ(found.size(), 35U) << turn;
    std::vector<Eigen::Vector2d> places;
    for (const std::size_t dot : found) places.push_back(all[dot]);
    EXPECT_TRUE(is_lattice(places, 7, 5)) << turn;
    // Row by row, forwards or backwards.
    EXPECT_TRUE(places.front() == grid[0] || places.front() == grid[6] || places.front() == grid[28] ||
                places.front() == grid[34])
        << turn;
  }
}

TEST(DotLattice, WithoutOneOfItsDotsIsNone) {
  std::vector<Eigen::Vector2d> places = slanted(0.8);
  places.erase(places.begin() + 17);
  EXPECT_TRUE(dot_lattice(places, 7, 5).empty());
  places = slanted(0.8);
  std::swap(places[8], places[9]);
  EXPECT_FALSE(is_lattice(places, 7, 5));
}

}  // namespace
}  // namespace flash::calib
