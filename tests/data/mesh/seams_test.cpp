#include "data/mesh/seams.h"

#include <gtest/gtest.h>

namespace flash::data {
namespace {

/// Two squares side by side; the second has the corners `a` and `b` where the first has 1 and 2.
TriangleMesh squares(int a, int b) {
  TriangleMesh mesh;
  mesh.vertices.resize(8, 3);
  mesh.vertices << 0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, 1, 0, 0, 2, 0, 0, 2, 1, 0, 1, 1, 0;
  mesh.triangles.resize(4, 3);
  mesh.triangles << 0, 1, 2, 0, 2, 3, a, 5, 6, a, 6, b;
  return mesh;
}

TEST(Seams, VerticesInOnePlaceAndThePartsAreCounted) {
  EXPECT_EQ(seam_warning(squares(4, 7)),
            "4 of its 8 vertices share a place with another and are not joined: the mesh falls into 2 parts; "
            "flash-sim mesh --weld joins them");
}

TEST(Seams, ASlitIsToldFromParts) {
  TriangleMesh mesh = squares(1, 7);  // joined at one end
  mesh.vertices.row(4) << 5, 5, 5;
  mesh.triangles.conservativeResize(5, 3);
  mesh.triangles.row(4) << 5, 4, 6;
  EXPECT_EQ(seam_warning(mesh),
            "2 of its 8 vertices share a place with another and are not joined: the mesh is slit there; "
            "flash-sim mesh --weld joins them");
}

TEST(Seams, AMeshOfPartsThatStandApartHasNone) {
  TriangleMesh mesh = squares(4, 7);
  mesh.vertices.bottomRows(4).col(2).setConstant(1e-9);
  EXPECT_EQ(seam_warning(mesh), "");
}

}  // namespace
}  // namespace flash::data
