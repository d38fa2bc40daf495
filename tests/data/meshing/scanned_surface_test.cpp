#include "data/meshing/scanned_surface.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "data/files/error.h"
#include "data/mesh/mesh_io.h"
#include "data/meshing/flatten.h"
#include "tests/data/meshing/drawn_surfaces.h"

namespace flash::data {
namespace {

constexpr double edge = 0.01, smoothing = 0.75 * edge;

TEST(ScannedSurface, RolledSheetIsFoundAndLaidOutToItsSize) {
  constexpr double width = 0.3, height = 0.2, radius = 0.15;
  constexpr int count = 40000;
  const Points cloud = rolled(drawn_rectangle(width, height, count, 0.001, 1), radius, width);
  const ScannedSurface sheet = mesh_of_cloud(cloud, {edge}, "rolled");
  EXPECT_NO_THROW(check_triangle_mesh(sheet.mesh, "mesh"));
  EXPECT_EQ(sheet.euler, 1);
  EXPECT_EQ(sheet.borders, 1);
  EXPECT_GT(sheet.edges.least, 0.5 * edge);
  EXPECT_LT(sheet.edges.largest, 1.6 * edge);
  // The points lie off it by their noise, by what is left of it after averaging over the weights (235
  // points), and by the sagitta of an edge, 1e-4.
  EXPECT_NEAR(sheet.distance_rms, 0.001, 0.0001);

  const FlatShape flat = flattened(sheet.mesh, "rolled");
  EXPECT_EQ(flat.inverted, 0);
  // A place of the border is where the mean of n = 2 pi s^2 points / area lies: uncertain by s / sqrt(n). The
  // least rectangle goes by the outermost of some thirty independent places to each side: 2.2 of that.
  const double points = count / (width * height) * 2 * EIGEN_PI * smoothing * smoothing;
  const double tolerance = 2 * 2.5 * smoothing / std::sqrt(points);
  EXPECT_NEAR(flat.width, width, tolerance);
  EXPECT_NEAR(flat.height, height, tolerance);
  // In the mean of the border that goes: four corners lose less than s^2 / 2 each, chords (edge / R)^2 / 24.
  const double lost = 2 * smoothing * smoothing + width * height * std::pow(edge / radius, 2) / 24;
  const double area_sd = 2 * (width + height) * smoothing / std::sqrt(points) / std::sqrt(60.0);
  EXPECT_LT(area_of({flat.vertices, sheet.mesh.triangles}), width * height + 3 * area_sd);
  EXPECT_GT(area_of({flat.vertices, sheet.mesh.triangles}), width * height - 3 * area_sd - lost);
  // Normal noise of 1 mm / sqrt(235) between vertices strains an edge by half its slope squared, 4e-5; chords
  // across and along a cylinder differ by (edge / R)^2 / 24 = 2e-4.
  EXPECT_LT(flat.rms_strain, 1e-3);
}

TEST(ScannedSurface, CapOfASphereIsToldByItsStrain) {
  constexpr double along = 0.1, radius = 0.3;
  Points flat_points = drawn_rectangle(2 * along, 2 * along, 60000, 0.0005, 2);
  std::vector<Eigen::Index> within;
  for (Eigen::Index i = 0; i < flat_points.rows(); ++i) {
    flat_points.row(i).head<2>().array() -= along;
    if (flat_points.row(i).head<2>().norm() < along) within.push_back(i);
  }
  const Points disc_points = flat_points(within, Eigen::all);
  const ScannedSurface sheet = mesh_of_cloud(capped(disc_points, radius), {edge}, "cap");
  const FlatShape flat = flattened(sheet.mesh, "cap");
  const double expected = along * along / (radius * radius) / (16 * std::sqrt(2));
  // The plate's theory leaves out (r / R)^2 = 0.11 of it, and the radius is known to s / 10 / r: 0.015.
  EXPECT_NEAR(flat.rms_strain, expected, 0.13 * expected);
}

TEST(ScannedSurface, FlecksAreLeftOutAndHolesClosed) {
  Points cloud = drawn_rectangle(0.2, 0.2, 30000, 0.0005, 3);
  std::vector<Eigen::Index> kept;
  for (Eigen::Index i = 0; i < cloud.rows(); ++i)
    if ((cloud.row(i).head<2>() - Eigen::RowVector2d(0.1, 0.1)).norm() > 0.02) kept.push_back(i);
  Points with_flecks(Eigen::Index(kept.size()) + 40, 3);
  with_flecks << cloud(kept, Eigen::all),
      drawn_rectangle(0.2, 0.2, 40, 0.05, 4).rowwise() + Eigen::RowVector3d(0, 0, 0.3);
  const ScannedSurface open = mesh_of_cloud(with_flecks, {edge, 0, 0.03}, "holed");
  EXPECT_EQ(open.borders, 2);
  EXPECT_GE(open.outliers, 35u);  // flecks near one another may hold
  const ScannedSurface closed = mesh_of_cloud(with_flecks, {edge, 0, 0.045}, "holed");
  EXPECT_EQ(closed.filled, 1);
  EXPECT_EQ(closed.borders, 1);
  EXPECT_LT(closed.mesh.vertices.col(2).cwiseAbs().maxCoeff(), 0.001);
}

TEST(ScannedSurface, IsTheSameEachTime) {
  const Points cloud = rolled(drawn_rectangle(0.1, 0.1, 10000, 0.001, 5), 0.1, 0.1);
  const ScannedSurface first = mesh_of_cloud(cloud, {edge}, "one"),
                       second = mesh_of_cloud(cloud, {edge}, "two");
  EXPECT_TRUE(first.mesh.vertices == second.mesh.vertices);
  EXPECT_TRUE(first.mesh.triangles == second.mesh.triangles);
}

TEST(ScannedSurface, ScannersMeshIsMadeEven) {
  TriangleMesh scan = rectangle({0.2, 0.15, 60, 37, DiagonalPattern::jittered});
  scan.vertices = rolled(scan.vertices, 0.1, 0.2);
  const ScannedSurface sheet = mesh_of_surface(scan, {edge}, "scan");
  EXPECT_EQ(sheet.euler, 1);
  EXPECT_GT(sheet.edges.least, 0.5 * edge);
  EXPECT_LT(sheet.edges.largest, 1.6 * edge);
  const FlatShape flat = flattened(sheet.mesh, "scan");
  // Chords of at most 1.6 edges shorten the arc by (chord / R)^2 / 24: 0.0011.
  EXPECT_NEAR(flat.width, 0.2, 0.0011 * 0.2);
  EXPECT_NEAR(flat.height, 0.15, 0.0011 * 0.15);
}

std::string refusal(const Points& cloud, double scale) {
  try {
    mesh_of_cloud(scale * cloud, {edge}, "scan.ply");
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(ScannedSurface, WhatIsNoScanInMetresIsRefused) {
  const Points cloud = drawn_rectangle(0.3, 0.2, 5000, 0, 6);
  EXPECT_EQ(refusal(cloud.topRows(1), 1), "scan.ply: found 1 points, expected 20 at least");
  EXPECT_NE(refusal(cloud, 0.001).find("expected four times --edge 0.01 at least"), std::string::npos);
  Points line = cloud;
  line.rightCols<2>().setZero();
  EXPECT_NE(refusal(line, 1).find("is 0 m wide where it spans"), std::string::npos);
  EXPECT_NE(refusal(cloud, 1000).find("m apart, expected at most 3/4 of --edge 0.01"), std::string::npos);
  EXPECT_NE(refusal(cloud, 1000).find("--scale 0.001"), std::string::npos);
  EXPECT_NE(refusal(cloud, 1e6).find("expected at most 100,000 times --edge"), std::string::npos);
}

}  // namespace
}  // namespace flash::data
