#include "data/meshing/graded.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <map>

#include "data/mesh/mesh_io.h"
#include "data/mesh/procedural_mesh.h"
#include "data/meshing/remesh.h"
#include "data/meshing/surface_topology.h"

namespace flash::data {
namespace {

constexpr double side = 0.3, within = 0.02;

PlacedSheet even_sheet(double cell) {
  RectangleMesh settings{side, side, int(std::lround(side / cell)), int(std::lround(side / cell))};
  const TriangleMesh mesh = remeshed(rectangle(settings), cell);
  return {mesh, mesh.vertices};
}

/// Of a square patch at the corner (side, side).
Outline square(double near, double near_corner) {
  return {[](const Eigen::Vector3d& x) {
            return (x - Eigen::Vector3d(side, side, 0)).head<2>().cwiseAbs().maxCoeff() - within;
          },
          near,
          {Eigen::Vector3d(side - within, side - within, 0)},
          near_corner};
}

Outline circle(double near) {
  return {[](const Eigen::Vector3d& x) { return (x - Eigen::Vector3d(0.1, 0.12, 0)).norm() - 0.03; }, near};
}

double least_angle(const TriangleMesh& mesh) {
  double least = EIGEN_PI;
  for (const auto& t : mesh.triangles.rowwise())
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d a = mesh.vertices.row(t[(k + 1) % 3]) - mesh.vertices.row(t[k]),
                            b = mesh.vertices.row(t[(k + 2) % 3]) - mesh.vertices.row(t[k]);
      least = std::min(least, std::atan2(a.cross(b).norm(), a.dot(b)));
    }
  return least;
}

double area_inside(const TriangleMesh& mesh, const Outline& outline) {
  double area = 0;
  for (const auto& t : mesh.triangles.rowwise()) {
    const Eigen::Vector3d a = mesh.vertices.row(t[0]), b = mesh.vertices.row(t[1]),
                          c = mesh.vertices.row(t[2]);
    if (outline.distance((a + b + c) / 3) < 0) area += 0.5 * (b - a).cross(c - a).norm();
  }
  return area;
}

/// A sheet without gaps, that covers what it did, all triangles looking up.
void expect_sound(const PlacedSheet& sheet) {
  EXPECT_NO_THROW(check_triangle_mesh(sheet.rest, "graded"));
  const SurfaceTopology topology = topology_of(sheet.rest);
  EXPECT_EQ(topology.euler, 1);
  EXPECT_EQ(topology.borders.size(), 1u);
  EXPECT_NEAR(area_of(sheet.rest), side * side, 1e-12);
  for (const auto& t : sheet.rest.triangles.rowwise()) {
    const Eigen::Vector3d a = sheet.rest.vertices.row(t[1]) - sheet.rest.vertices.row(t[0]),
                          b = sheet.rest.vertices.row(t[2]) - sheet.rest.vertices.row(t[0]);
    EXPECT_GT(a.cross(b).z(), 0);
  }
}

TEST(Graded, EdgesShrinkTowardsAnOutlineAsAsked) {
  const Outline outline = square(0.004, 0.0005);
  const PlacedSheet even = even_sheet(0.02);
  const PlacedSheet graded = refined_towards(even, {outline});
  expect_sound(graded);
  for (const auto& t : graded.rest.triangles.rowwise())
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d a = graded.rest.vertices.row(t[k]), b = graded.rest.vertices.row(t[(k + 1) % 3]);
      for (const Eigen::Vector3d& x : {a, b}) {
        EXPECT_LE((a - b).norm(), 4.0 / 3 * (0.004 + 0.3 * std::abs(outline.distance(x))) + 1e-12);
        EXPECT_LE((a - b).norm(), 4.0 / 3 * (0.0005 + 0.5 * (x - outline.corners[0]).norm()) + 1e-12);
      }
    }
  // Rivara 1984: not below half of the least there was.
  EXPECT_GE(least_angle(graded.rest), 0.5 * least_angle(even.rest));
  EXPECT_EQ(graded.rest.vertices.topRows(even.rest.vertices.rows()), even.rest.vertices);
}

TEST(Graded, EdgesRunAlongTheOutlines) {
  for (const double cell : {0.04, 0.02, 0.013})
    for (const double near : {0.005, 0.003}) {
      const std::vector<Outline> outlines = {square(near, near / 8), circle(near)};
      const PlacedSheet aligned = aligned_with(refined_towards(even_sheet(cell), outlines), outlines);
      expect_sound(aligned);
      EXPECT_NEAR(area_inside(aligned.rest, outlines[0]), within * within, 1e-10);
      // A polygon of edges of at most 1.5 near within the circle: its segments are each 2/3 R sagitta of it.
      const double lost = EIGEN_PI * 0.03 * 0.03 * std::pow(1.5 * near, 2) / (6 * 0.03 * 0.03);
      EXPECT_NEAR(area_inside(aligned.rest, outlines[1]), EIGEN_PI * 0.03 * 0.03, lost);
      EXPECT_GT(least_angle(aligned.rest), EIGEN_PI / 180);
    }
}

TEST(Graded, HalvedCellsAreNestedAndQuarters) {
  const PlacedSheet even = even_sheet(0.03), halves = halved_cells(even);
  expect_sound(halves);
  ASSERT_EQ(halves.rest.triangles.rows(), 4 * even.rest.triangles.rows());
  for (Eigen::Index i = 0; i < even.rest.triangles.rows(); ++i) {
    const TriangleMesh one{even.rest.vertices, even.rest.triangles.middleRows(i, 1)},
        quarter{halves.rest.vertices, halves.rest.triangles.middleRows(4 * i, 1)};
    EXPECT_NEAR(area_of(quarter), area_of(one) / 4, 1e-15);
  }
}

/// Where a sheet starts bent, what is added starts on its triangles.
TEST(Graded, AddedVerticesStartOnTheSheet) {
  PlacedSheet sheet = even_sheet(0.02);
  for (auto row : sheet.start.rowwise()) row.z() = row.x() + 2 * row.y();  // linear: exact on any triangles
  const std::vector<Outline> outlines = {square(0.004, 0.001)};
  const PlacedSheet graded = halved_cells(aligned_with(refined_towards(sheet, outlines), outlines));
  for (Eigen::Index i = 0; i < graded.start.rows(); ++i) {
    EXPECT_NEAR(graded.start(i, 0), graded.rest.vertices(i, 0), 1e-12);
    EXPECT_NEAR(graded.start(i, 2), graded.rest.vertices(i, 0) + 2 * graded.rest.vertices(i, 1), 1e-12);
  }
  ASSERT_EQ(Eigen::Index(graded.added.size()), graded.rest.vertices.rows() - sheet.rest.vertices.rows());
}

}  // namespace
}  // namespace flash::data
