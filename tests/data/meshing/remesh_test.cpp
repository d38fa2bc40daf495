#include "data/meshing/remesh.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "data/mesh/mesh_io.h"
#include "data/meshing/surface_topology.h"
#include "data/meshing/triangle_tree.h"
#include "tests/data/meshing/drawn_surfaces.h"

namespace flash::data {
namespace {

constexpr double edge = 0.01;

void expect_even(const TriangleMesh& mesh) {
  const EdgeLengths lengths = edge_lengths(mesh);
  EXPECT_GT(lengths.least, 0.5 * edge);
  EXPECT_LT(lengths.largest, 1.6 * edge);
  EXPECT_NO_THROW(check_triangle_mesh(mesh, "remeshed"));
}

TEST(Remesh, RectangleKeepsItsCornersAndItsArea) {
  for (const double cell : {0.005, 0.013, 0.1}) {
    const TriangleMesh mesh = remeshed(delaunay_rectangle(0.3, 0.2, cell, 3), edge);
    expect_even(mesh);
    EXPECT_NEAR(area_of(mesh), 0.06, 1e-12);
    const SurfaceTopology topology = topology_of(mesh);
    EXPECT_EQ(topology.euler, 1);
    EXPECT_EQ(topology.borders.size(), 1u);
    for (const auto& t : mesh.triangles.rowwise()) {
      const Eigen::Vector3d a = mesh.vertices.row(t[1]) - mesh.vertices.row(t[0]),
                            b = mesh.vertices.row(t[2]) - mesh.vertices.row(t[0]);
      EXPECT_GT(a.cross(b).z(), 0);
    }
  }
}

TEST(Remesh, VerticesStayOnACurvedSurfaceAndItsBorder) {
  TriangleMesh cap = disc(0.1, 0.005);
  cap.vertices = capped(cap.vertices, 0.15);
  const TriangleMesh mesh = remeshed(cap, edge);
  expect_even(mesh);
  const TriangleTree tree(cap);
  for (const auto& x : mesh.vertices.rowwise())
    EXPECT_LT((tree.nearest(x.transpose()).place - x.transpose()).norm(), 1e-12);
  // The border is a polygon within a circle at 0.1 along the sphere; its chords are at most 1.6 edges.
  const double rim = 0.15 * std::sin(0.1 / 0.15), sagitta = std::pow(1.6 * edge, 2) / (8 * rim);
  const SurfaceTopology topology = topology_of(mesh);
  ASSERT_EQ(topology.borders.size(), 1u);
  for (const int vertex : topology.borders[0]) {
    const double r = mesh.vertices.row(vertex).head<2>().norm();
    EXPECT_LT(r, rim + 1e-12);
    EXPECT_GT(r, rim - sagitta);
  }
}

TEST(Remesh, ClosedSurfaceStaysClosed) {
  // An octahedron, whose edges of 0.14 are split many times.
  TriangleMesh mesh{Points(6, 3), Triangles(8, 3)};
  mesh.vertices << 0.1, 0, 0, -0.1, 0, 0, 0, 0.1, 0, 0, -0.1, 0, 0, 0, 0.1, 0, 0, -0.1;
  mesh.triangles << 0, 2, 4, 2, 1, 4, 1, 3, 4, 3, 0, 4, 2, 0, 5, 1, 2, 5, 3, 1, 5, 0, 3, 5;
  const SurfaceTopology topology = topology_of(remeshed(mesh, edge));
  EXPECT_EQ(topology.components, 1);
  EXPECT_EQ(topology.euler, 2);
  EXPECT_TRUE(topology.borders.empty());
}

}  // namespace
}  // namespace flash::data
