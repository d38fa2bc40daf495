#include "data/meshing/flatten.h"

#include <gtest/gtest.h>

#include <cmath>

#include "data/files/error.h"
#include "tests/data/meshing/drawn_surfaces.h"

namespace flash::data {
namespace {

TEST(Flatten, SheetOfFlatFacesIsLaidOutExactly) {
  constexpr double width = 0.3, height = 0.2, radius = 0.1;
  constexpr int cells = 30;
  TriangleMesh mesh = rectangle({width, height, cells, 20});
  mesh.vertices = rolled(mesh.vertices, radius, width);
  const FlatShape flat = flattened(mesh, "rolled");
  // The vertices of a column lie on a line of the cylinder: the facets are plane, and as wide as chords.
  const double chord = 2 * radius * std::sin(width / cells / radius / 2);
  // The conformal layout is exact; its linear system, of condition cells^4, loses some digits.
  EXPECT_NEAR(flat.width, cells * chord, 1e-8);
  EXPECT_NEAR(flat.height, height, 1e-8);
  EXPECT_LT(flat.largest_strain, 1e-8);
  EXPECT_EQ(flat.inverted, 0);
  EXPECT_EQ(flat.vertices.col(2).cwiseAbs().maxCoeff(), 0);
}

TEST(Flatten, CapOfASphereIsStrainedAsThePlateIs) {
  constexpr double along = 0.06, radius = 0.3;
  TriangleMesh mesh = disc(along, 0.002);
  mesh.vertices = capped(mesh.vertices, radius);
  const FlatShape flat = flattened(mesh, "cap");
  const double strain = along * along / (radius * radius);  // 0.04: what theory leaves out is as much of it
  EXPECT_NEAR(flat.rms_strain, strain / (16 * std::sqrt(2)), 0.05 * strain / (16 * std::sqrt(2)));
  EXPECT_NEAR(flat.largest_strain, strain / 8,
              0.08 * strain / 8);  // edges lie up to half a cell inside the rim
  EXPECT_EQ(flat.inverted, 0);
}

TEST(Flatten, WhatIsNoDiscIsRefused) {
  TriangleMesh ring = rectangle({0.3, 0.3, 3, 3});
  Triangles without_middle(16, 3);
  without_middle << ring.triangles.topRows(8), ring.triangles.bottomRows(8);
  ring.triangles = without_middle;
  try {
    flattened(ring, "ring.obj");
    FAIL() << "a ring was laid flat";
  } catch (const InputError& error) {
    EXPECT_STREQ(error.what(),
                 "ring.obj: does not lie flat: found 1 parts, 2 borders and the Euler characteristic 0, "
                 "expected one disc: 1, 1 and 1");
  }
}

}  // namespace
}  // namespace flash::data
