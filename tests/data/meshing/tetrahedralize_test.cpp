#include "data/meshing/tetrahedralize.h"

#include <gtest/gtest.h>

#include <cstdlib>

#include "data/files/error.h"
#include "data/mesh/mesh_io.h"

namespace flash::data {
namespace {

TriangleMesh cube(double side) {
  TriangleMesh mesh{Points(8, 3), Triangles(12, 3)};
  for (int i = 0; i < 8; ++i) mesh.vertices.row(i) << side * (i & 1), side * (i >> 1 & 1), side * (i >> 2);
  mesh.triangles << 0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6, 0, 1, 5, 0, 5, 4, 2, 6, 7, 2, 7, 3, 0, 4, 6, 0, 6, 2,
      1, 3, 7, 1, 7, 5;
  return mesh;
}

TEST(Tetrahedralize, CubeIsFilledExactly) {
  if (std::system("command -v tetgen > /dev/null") != 0) GTEST_SKIP() << "tetgen is not installed";
  const FilledSolid solid = filled_solid(cube(0.1), 0.02, "cube");
  EXPECT_NEAR(solid.volume, 0.001, 1e-15);
  EXPECT_NEAR(solid.surface_volume, 0.001, 1e-15);
  EXPECT_NO_THROW(check_tet_mesh(solid.mesh, "cube"));
  // No tetrahedron is larger than a regular one of the edge.
  EXPECT_GT(solid.mesh.tetrahedra.rows(), 0.001 / (0.02 * 0.02 * 0.02 / 8.48));
  EXPECT_GT(solid.least_angle, 5);
  EXPECT_LT(solid.largest_angle, 175);
}

TEST(Tetrahedralize, OpenSurfaceIsRefused) {
  TriangleMesh open = cube(0.1);
  open.triangles.conservativeResize(11, 3);
  try {
    filled_solid(open, 0.02, "box.stl");
    FAIL() << "an open surface was filled";
  } catch (const InputError& error) {
    EXPECT_STREQ(error.what(),
                 "box.stl: is open along 3 edges; expected a closed surface, which has an inside to fill");
  }
}

}  // namespace
}  // namespace flash::data
