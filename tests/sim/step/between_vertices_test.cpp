#include "sim/step/between_vertices.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "tests/sim/lot.h"
#include "tests/sim/obstacle_depth.h"

namespace flash::sim {
namespace {

using Eigen::Vector3d;

constexpr double from = 1e-3;

/// One triangle, and one obstacle.
struct Pair {
  Sheet sheet;
  Environment environment;

  Pair(const data::Points& corners, const Obstacle& obstacle) {
    data::TriangleMesh mesh;
    mesh.vertices = (data::Points(3, 3) << 0, 0, 0, 1, 0, 0, 0, 1, 0).finished();
    mesh.triangles = (data::Triangles(1, 3) << 0, 1, 2).finished();
    sheet = make_sheet(mesh);
    environment.state.positions = corners;
    environment.obstacles = {obstacle};
  }
};

TEST(BetweenVertices, ARodThatATriangleFallsOverIsAsDeepAsItIs) {
  const data::Points corners = (data::Points(3, 3) << -1, -1, 0.006, 1, -1, 0.006, 0, 1, 0.006).finished();
  const Pair pair(corners, {Capsule{Vector3d(0, 0, 0), Vector3d(1, 0, 0), 0.5, 0.008}});
  const ComingThrough found = deepest_between_vertices(pair.sheet, pair.environment, from);
  EXPECT_EQ(found.obstacle, 0);
  EXPECT_NEAR(found.depth, 0.002, 0.1 * from);
}

TEST(BetweenVertices, WhatIsLessDeepThanAskedForIsNotTold) {
  const data::Points corners = (data::Points(3, 3) << -1, -1, 0.0075, 1, -1, 0.0075, 0, 1, 0.0075).finished();
  const Pair pair(corners, {Cylinder{Vector3d(0, 0, 0), Vector3d(1, 0, 0), 0.008}});
  EXPECT_EQ(deepest_between_vertices(pair.sheet, pair.environment, from).obstacle, -1);
  EXPECT_EQ(deepest_between_vertices(pair.sheet, pair.environment, from).depth, 0);
}

TEST(BetweenVertices, PositionsThatAreNowhereOrFarAwayEndTheLook) {
  for (const double place : {std::nan(""), std::numeric_limits<double>::infinity(), 1e12}) {
    const data::Points corners =
        (data::Points(3, 3) << -place, -place, 0.003, place, -place, 0.003, 0, place, 0.003).finished();
    for (const Obstacle& obstacle : {Obstacle{Capsule{Vector3d(0, 0, 0), Vector3d(1, 0, 0), 0.5, 0.008}},
                                     Obstacle{Box{.half_extents = {0.01, 0.01, 0.01}}}}) {
      const Pair pair(corners, obstacle);
      EXPECT_LT(deepest_between_vertices(pair.sheet, pair.environment, from).depth, 0.0101);
    }
  }
}

TEST(BetweenVertices, IsThatOfAllPlacesOfATriangle) {
  constexpr int many = 300;
  int deep = 0;
  for (unsigned long seed = 1; seed <= 200; ++seed) {
    Lot lot(seed);
    data::Points corners(3, 3);
    for (int i = 0; i < 3; ++i) corners.row(i) = lot.uniform(0.02, 0.1) * lot.direction().transpose();
    Obstacle obstacle;
    if (seed % 3 == 0) {
      Box box{.half_extents = {lot.log_uniform(0.005, 0.05), lot.log_uniform(0.005, 0.05),
                               lot.log_uniform(0.005, 0.05)}};
      box.pose = Eigen::Translation3d(0.01 * lot.direction()) *
                 Eigen::AngleAxisd(lot.uniform(0, 3), lot.direction());
      obstacle = {box};
    } else if (seed % 3 == 1) {
      obstacle = {Capsule{0.01 * lot.direction(), lot.direction(), lot.uniform(0, 0.05),
                          lot.log_uniform(0.003, 0.05)}};
    } else {
      obstacle = {Cylinder{0.01 * lot.direction(), lot.direction(), lot.log_uniform(0.003, 0.05)}};
    }
    const Pair pair(corners, obstacle);
    bool reaches_in = false;
    for (int i = 0; i < 3; ++i)
      reaches_in = reaches_in || depth_in(pair.environment, obstacle, corners.row(i), 0) > from;
    if (reaches_in) {  // which is the contact of vertices
      EXPECT_EQ(deepest_between_vertices(pair.sheet, pair.environment, from).obstacle, -1) << seed;
      continue;
    }
    double brute = 0;
    for (int i = 0; i <= many; ++i)
      for (int j = 0; i + j <= many; ++j) {
        const Vector3d place = corners.transpose() * Vector3d(i, j, many - i - j) / many;
        brute = std::max(brute, depth_in(pair.environment, obstacle, place, 0));
      }
    const double spacing = 0.2 / many;  // of the places, at most; the depth changes by no more between them
    const ComingThrough found = deepest_between_vertices(pair.sheet, pair.environment, from);
    if (found.obstacle < 0) {
      EXPECT_LE(brute, from + 0.1 * from) << seed;
      continue;
    }
    ++deep;
    EXPECT_GE(found.depth, brute - 0.1 * from) << seed;
    EXPECT_LE(found.depth, brute + spacing) << seed;
  }
  EXPECT_GT(deep, 60);
}

}  // namespace
}  // namespace flash::sim
