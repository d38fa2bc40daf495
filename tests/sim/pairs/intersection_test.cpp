#include "sim/pairs/intersection.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "tests/sim/lot.h"
#include "tests/sim/solid_scene.h"

namespace flash::sim {
namespace {

using Eigen::Vector3d;

/// Triangles of one face lie in a plane but for rounding, whose sign says nothing.
TEST(Intersection, TurnedCubesDoNotPassThroughThemselves) {
  const Sheet cube = solid_box(Vector3d::Constant(0.02), {3, 3, 3});
  PairSurface surface(cube);
  Lot lot(4);
  for (int k = 0; k < 2000; ++k) {
    const Eigen::Matrix3d turn = Eigen::AngleAxisd(lot.uniform(-3, 3), lot.direction()).toRotationMatrix();
    const data::Points turned = cube.rest.vertices * turn.transpose();
    ASSERT_FALSE(first_intersection(surface, turned)) << k;
  }
}

TEST(Intersection, AVertexBelowAFaceByMoreThanRoundingPasses) {
  const Vector3d face[3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  EXPECT_TRUE(passes({0.3, 0.3, 1}, {0.3, 0.3, -1e-12}, face));
  EXPECT_FALSE(passes({0.3, 0.3, 1}, {0.3, 0.3, 0}, face));
}

}  // namespace
}  // namespace flash::sim
