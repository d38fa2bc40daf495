#include "data/picture/mesh_picture.h"

#include <gtest/gtest.h>

#include "data/mesh/procedural_mesh.h"

namespace flash::data {
namespace {

TEST(MeshPicture, WhatIsNearerHidesWhatIsBehind) {
  // A small red square above a large blue one, seen from above and from below.
  TriangleMesh small = rectangle({.width = 1, .height = 1, .cells_x = 2, .cells_y = 2});
  TriangleMesh large = rectangle({.width = 3, .height = 3, .cells_x = 2, .cells_y = 2});
  small.vertices.rowwise() += Eigen::RowVector3d(1, 1, 0.5);
  for (const double elevation : {89.0, -89.0}) {
    const Picture picture = draw_meshes({{small, {200, 0, 0}}, {large, {0, 0, 200}}},
                                        {.width = 100, .height = 100, .azimuth = 0, .elevation = elevation});
    const Colour &middle = picture.at(50, 50), &beside = picture.at(20, 50), &corner = picture.at(0, 0);
    EXPECT_GT(beside[2], 80);
    EXPECT_EQ(beside[0], 0);
    EXPECT_EQ(corner, (Colour{255, 255, 255}));
    EXPECT_EQ(middle[0] > 80, elevation > 0);
    EXPECT_EQ(middle[2] > 80, elevation < 0);
  }
}

TEST(MeshPicture, UpIsUpAndTheEyeStandsWhereItIsSaid) {
  // From the x axis: y points right, z up.
  TriangleMesh wall;
  wall.vertices.resize(4, 3);
  wall.vertices << 0, 0, 0, 0, 2, 0, 0, 2, 1, 0, 0, 1;
  wall.triangles.resize(1, 3);
  wall.triangles << 0, 1, 2;  // without its upper left
  const Picture picture =
      draw_meshes({{wall, {200, 0, 0}}}, {.width = 200, .height = 100, .azimuth = 0, .elevation = 0});
  EXPECT_EQ(picture.at(30, 20), (Colour{255, 255, 255}));
  EXPECT_GT(picture.at(170, 60)[0], 80);
  EXPECT_EQ(picture.at(170, 60)[1], 0);
}

// A sheet that rests on a table sinks into it by rounding, here and there.
TEST(MeshPicture, WhatLiesOnAnotherMeshShowsWhereItIsNamedFirst) {
  TriangleMesh sheet = rectangle({.width = 1, .height = 1, .cells_x = 2, .cells_y = 2});
  const TriangleMesh table = rectangle({.width = 1, .height = 1, .cells_x = 1, .cells_y = 1});
  const auto middle = [&](double height, std::size_t channel) {
    TriangleMesh lying = sheet;
    lying.vertices.col(2).array() += height;
    return draw_meshes({{lying, {200, 0, 0}}, {table, {0, 0, 200}}},
                       {.width = 50, .height = 50, .azimuth = 0, .elevation = 40})
        .at(25, 25)[channel];
  };
  for (const double height : {-1e-6, 0.0, 1e-6}) EXPECT_GT(middle(height, 0), 80) << height;
  EXPECT_GT(middle(-0.01, 2), 80);  // below the table
}

TEST(MeshPicture, NothingIsAnEmptyPicture) {
  EXPECT_EQ(draw_meshes({}, {.width = 4, .height = 4}).at(1, 1), (Colour{255, 255, 255}));
}

}  // namespace
}  // namespace flash::data
