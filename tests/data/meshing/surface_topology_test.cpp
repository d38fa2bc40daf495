#include "data/meshing/surface_topology.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "data/files/error.h"
#include "data/meshing/triangle_tree.h"
#include "tests/data/meshing/drawn_surfaces.h"

namespace flash::data {
namespace {

/// A rectangle of 10 x 10 cells without the cells from (3, 3) on, `size` to each side.
TriangleMesh with_hole(int size) {
  const TriangleMesh whole = rectangle({0.1, 0.1, 10, 10});
  TriangleMesh mesh{whole.vertices, Triangles(200 - 2 * size * size, 3)};
  Eigen::Index row = 0;
  for (const auto& t : whole.triangles.rowwise()) {
    const Eigen::RowVector3d middle =
        (whole.vertices.row(t[0]) + whole.vertices.row(t[1]) + whole.vertices.row(t[2])) / 3;
    const auto within = [&](double x) { return x > 0.03 && x < 0.03 + 0.01 * size; };
    if (!within(middle[0]) || !within(middle[1])) mesh.triangles.row(row++) = t;
  }
  return mesh;
}

TEST(SurfaceTopology, HolesAreCountedAndThoseOfTheSizeClosed) {
  const TriangleMesh mesh = checked_surface(with_hole(3), "sheet");
  const SurfaceTopology before = topology_of(mesh);
  EXPECT_EQ(before.components, 1);
  EXPECT_EQ(before.euler, 0);
  ASSERT_EQ(before.borders.size(), 2u);
  EXPECT_EQ(before.borders[0].size(), 40u);
  EXPECT_EQ(before.borders[1].size(), 12u);
  // Its border of 0.12 m is that of a circle of 0.038 m.
  EXPECT_EQ(fill_holes(mesh, 0.038).filled, 0);
  const FilledSurface filled = fill_holes(mesh, 0.0382);
  EXPECT_EQ(filled.filled, 1);
  const SurfaceTopology after = topology_of(checked_surface(filled.mesh, "filled"));
  EXPECT_EQ(after.euler, 1);
  EXPECT_EQ(after.borders.size(), 1u);
  EXPECT_NEAR(area_of(filled.mesh), 0.01, 1e-15);
}

TEST(SurfaceTopology, PartsThatTouchInAPointComeApartAndTheLargestStays) {
  TriangleMesh mesh{Points(6, 3), Triangles(3, 3)};
  mesh.vertices << 0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0, -1, 0, 0, 0, -1, 0;
  mesh.triangles << 0, 1, 2, 1, 3, 2, 0, 4, 5;
  const TriangleMesh apart = checked_surface(mesh, "bow");
  EXPECT_EQ(apart.vertices.rows(), 7);
  EXPECT_EQ(topology_of(apart).components, 2);
  double dropped = 0;
  const TriangleMesh largest = largest_component(apart, dropped);
  EXPECT_EQ(largest.vertices.rows(), 4);
  EXPECT_NEAR(dropped, 0.5 / 1.5, 1e-15);
}

TEST(SurfaceTopology, EdgeOfThreeTrianglesIsNamed) {
  TriangleMesh mesh{Points(5, 3), Triangles(3, 3)};
  mesh.vertices << 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, -1, 0, 0, 0, 1;
  mesh.triangles << 0, 1, 2, 1, 0, 3, 0, 1, 4;
  try {
    checked_surface(mesh, "fin.obj");
    FAIL() << "three triangles on an edge were taken";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("fin.obj: edge at (0.5, 0, 0): is no part of one surface"),
              std::string::npos)
        << error.what();
  }
}

TEST(TriangleTree, NearestPointIsThatOfAllTriangles) {
  TriangleMesh mesh = rectangle({0.3, 0.2, 9, 6, DiagonalPattern::jittered});
  mesh.vertices = rolled(mesh.vertices, 0.06, 0.3);
  const TriangleTree tree(mesh);
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> even(-0.2, 0.2);
  for (int i = 0; i < 40; ++i) {
    const Eigen::Vector3d p(even(random), even(random), even(random));
    // Points of a triangle by its barycentric lattice: at most a step of 1/10 of an edge of 0.06 off.
    double least = 1;
    for (const auto& t : mesh.triangles.rowwise())
      for (int a = 0; a <= 10; ++a)
        for (int b = 0; a + b <= 10; ++b) {
          const Eigen::RowVector3d x = (a * mesh.vertices.row(t[0]) + b * mesh.vertices.row(t[1]) +
                                        (10 - a - b) * mesh.vertices.row(t[2])) /
                                       10;
          least = std::min(least, (x.transpose() - p).norm());
        }
    const double distance = (tree.nearest(p).place - p).norm();
    EXPECT_LE(distance, least + 1e-15);
    EXPECT_GE(distance, least - 0.06 / 10);
  }
}

}  // namespace
}  // namespace flash::data
