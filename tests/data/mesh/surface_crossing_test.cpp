#include "data/mesh/surface_crossing.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <random>

#include "data/mesh/obstacle_mesh.h"
#include "tests/data/temporary_folder.h"

namespace flash::data {
namespace {

/// A sphere of `rings` times twice as many triangles pairs, its radius changed by `shape(polar, azimuth)`.
template <class Shape>
TriangleMesh sphere(int rings, const Shape& shape) {
  const int around = 2 * rings;
  TriangleMesh mesh{Points((rings - 1) * around + 2, 3), Triangles(2 * (rings - 1) * around, 3)};
  const auto place = [&](double polar, double azimuth) {
    return Eigen::RowVector3d(shape(polar, azimuth) * Eigen::RowVector3d(std::sin(polar) * std::cos(azimuth),
                                                                         std::sin(polar) * std::sin(azimuth),
                                                                         std::cos(polar)));
  };
  const auto vertex = [&](int ring, int k) { return (ring - 1) * around + k % around; };
  const int top = (rings - 1) * around, bottom = top + 1;
  for (int ring = 1; ring < rings; ++ring)
    for (int k = 0; k < around; ++k)
      mesh.vertices.row(vertex(ring, k)) = place(M_PI * ring / rings, 2 * M_PI * k / around);
  mesh.vertices.row(top) = place(0, 0);
  mesh.vertices.row(bottom) = place(M_PI, 0);
  int t = 0;
  for (int k = 0; k < around; ++k) {
    mesh.triangles.row(t++) << top, vertex(1, k), vertex(1, k + 1);
    mesh.triangles.row(t++) << bottom, vertex(rings - 1, k + 1), vertex(rings - 1, k);
    for (int ring = 1; ring + 1 < rings; ++ring) {
      mesh.triangles.row(t++) << vertex(ring, k), vertex(ring + 1, k), vertex(ring + 1, k + 1);
      mesh.triangles.row(t++) << vertex(ring, k), vertex(ring + 1, k + 1), vertex(ring, k + 1);
    }
  }
  return mesh;
}

TriangleMesh ball(int rings) {
  return sphere(rings, [](double, double) { return 0.1; });
}

/// One vertex of a ball is pulled out through the other side.
TriangleMesh pierced(int rings) {
  TriangleMesh mesh = ball(rings);
  mesh.vertices.row(0) *= -1.2;
  return mesh;
}

std::string message_of(const TriangleMesh& mesh) {
  return input_error_of([&] { checked_obstacle_mesh(mesh, "ball.obj"); });
}

/// Whether a segment meets a triangle, by its barycentric coordinates.
bool meets(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const TriangleMesh& mesh, int t) {
  Eigen::Matrix3d columns;
  const Eigen::Vector3d origin = mesh.vertices.row(mesh.triangles(t, 0));
  columns.col(0) = mesh.vertices.row(mesh.triangles(t, 1)).transpose() - origin;
  columns.col(1) = mesh.vertices.row(mesh.triangles(t, 2)).transpose() - origin;
  columns.col(2) = a - b;
  const Eigen::Vector3d share = columns.inverse() * (a - origin);
  return share.allFinite() && share.minCoeff() >= 0 && share[0] + share[1] <= 1 && share[2] <= 1;
}

TEST(SurfaceCrossing, TheFirstPairIsThatOfAllPairs) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> anywhere(0, 1);
  for (int draw = 0; draw < 40; ++draw) {
    TriangleMesh mesh{Points(36, 3), Triangles(12, 3)};  // far apart but for a few
    for (double& x : mesh.vertices.reshaped()) x = 0.35 * anywhere(random);
    for (int t = 0; t < 12; ++t) {
      mesh.triangles.row(t) << 3 * t, 3 * t + 1, 3 * t + 2;
      const Eigen::RowVector3d by(anywhere(random), anywhere(random), anywhere(random));
      for (int k = 0; k < 3; ++k) mesh.vertices.row(3 * t + k) += by;
    }
    std::optional<TrianglePair> expected;
    for (int s = 0; s < 12 && !expected; ++s)
      for (int t = s + 1; t < 12 && !expected; ++t)
        for (int k = 0; k < 3; ++k) {
          const auto x = [&](int of, int n) { return Eigen::Vector3d(mesh.vertices.row(3 * of + n % 3)); };
          if (meets(x(s, k), x(s, k + 1), mesh, t) || meets(x(t, k), x(t, k + 1), mesh, s)) expected = {s, t};
        }
    EXPECT_EQ(first_crossing(mesh), expected) << draw;
  }
}

TEST(SurfaceCrossing, ASurfaceThatPassesThroughItselfIsRefusedWithBothTriangles) {
  EXPECT_EQ(message_of(ball(8)), "");
  const std::string said = message_of(pierced(8));
  EXPECT_NE(said.find("ball.obj: triangle "), std::string::npos) << said;
  EXPECT_NE(said.find(" passes through triangle "), std::string::npos) << said;
  EXPECT_NE(said.find("expected a closed surface that does not meet itself"), std::string::npos) << said;
}

// Neighbours over a vertex alone.
TEST(SurfaceCrossing, NeighboursThatFoldThroughEachOtherAreFound) {
  TriangleMesh mesh{Points(5, 3), Triangles(2, 3)};
  mesh.vertices << 0, 0, 0, 1, 0, 0, 0, 1, 0, 0.4, 0.2, -0.3, 0.4, 0.2, 0.3;
  mesh.triangles << 0, 1, 2, 0, 3, 4;
  EXPECT_EQ(first_crossing(mesh), (TrianglePair{0, 1}));
  mesh.vertices(3, 2) = 0.1;
  EXPECT_EQ(first_crossing(mesh), std::nullopt);
}

// As the legs of a chair in its seat: each part has an inside.
TEST(SurfaceCrossing, PartsOfAnObstacleMayReachIntoEachOther) {
  TriangleMesh two = ball(8), other = ball(8);
  other.vertices.col(0).array() += 0.13;
  const Eigen::Index n = two.vertices.rows(), m = two.triangles.rows();
  two.vertices.conservativeResize(2 * n, 3);
  two.triangles.conservativeResize(2 * m, 3);
  two.vertices.bottomRows(n) = other.vertices;
  two.triangles.bottomRows(m) = other.triangles.array() + int(n);
  EXPECT_EQ(message_of(two), "");
  EXPECT_TRUE(first_crossing(two));
  EXPECT_THROW(check_crossings(two, "two.obj"), InputError);  // a solid that is filled has one inside
}

TEST(SurfaceCrossing, ManyTrianglesArePassedThroughOnce) {
  const TriangleMesh bumpy = sphere(230, [](double polar, double azimuth) {
    return 0.1 + 0.01 * std::sin(20 * polar) * std::sin(15 * azimuth);
  });
  ASSERT_GT(bumpy.triangles.rows(), 200'000);
  EXPECT_EQ(first_crossing(bumpy), std::nullopt);
  EXPECT_EQ(first_cover(bumpy), std::nullopt);
}

TEST(SurfaceCrossing, TrianglesThatLieOnEachOtherAreFound) {
  TriangleMesh mesh{Points(6, 3), Triangles(2, 3)};
  mesh.vertices << 0, 0, 0, 1, 0, 0, 0, 1, 0, 0.9, 0.9, 0, 0.2, 0.2, 0, 0.9, 0.2, 0;
  mesh.triangles << 0, 1, 2, 3, 4, 5;
  EXPECT_EQ(first_cover(mesh), (TrianglePair{0, 1}));
  mesh.vertices.bottomRows(3).col(2).array() = 1e-3;  // above it
  EXPECT_EQ(first_cover(mesh), std::nullopt);
  mesh.vertices.bottomRows(3).col(2).setZero();
  mesh.vertices.bottomRows(3).col(0).array() += 0.85;  // beside it
  EXPECT_EQ(first_cover(mesh), std::nullopt);
}

}  // namespace
}  // namespace flash::data
