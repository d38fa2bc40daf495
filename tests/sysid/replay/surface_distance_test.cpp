#include "sysid/replay/surface_distance.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <random>

#include "tests/sysid/moving_sheet.h"

namespace flash::sysid {
namespace {

/// Independent oracle: the plane's foot point where it lies inside, else the nearest of the three edges.
double brute_force(const Eigen::Vector3d& query, const data::TriangleMesh& mesh) {
  double best = 1e9;
  const auto to_segment = [&](const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
    const double length2 = (b - a).squaredNorm();
    const double s = length2 > 0 ? std::clamp((query - a).dot(b - a) / length2, 0.0, 1.0) : 0.0;
    return (query - a - s * (b - a)).norm();
  };
  for (Eigen::Index i = 0; i < mesh.triangles.rows(); ++i) {
    const Eigen::Vector3d a = mesh.vertices.row(mesh.triangles(i, 0)),
                          b = mesh.vertices.row(mesh.triangles(i, 1)),
                          c = mesh.vertices.row(mesh.triangles(i, 2));
    best = std::min({best, to_segment(a, b), to_segment(b, c), to_segment(c, a)});
    const Eigen::Vector3d normal = (b - a).cross(c - a);
    if (normal.norm() == 0) continue;
    const Eigen::Vector3d foot = query - normal * normal.dot(query - a) / normal.squaredNorm();
    const bool inside = normal.dot((b - a).cross(foot - a)) >= 0 &&
                        normal.dot((c - b).cross(foot - b)) >= 0 && normal.dot((a - c).cross(foot - c)) >= 0;
    if (inside) best = std::min(best, (query - foot).norm());
  }
  return best;
}

TEST(SurfaceDistance, IsThatOfABruteForceOnAMovingSheetNearAndFar) {
  for (const sim::InstructionLevel level : sim::instruction_levels()) {
    SCOPED_TRACE(to_string(level));
    for (const int cells : {1, 2, 7, 20}) {
      data::TriangleMesh mesh = flat_sheet(cells);
      SurfaceDistance surface(mesh.triangles, mesh.vertices, level);
      std::mt19937 random(7);
      std::uniform_real_distribution<double> uniform(-0.3, 0.7);
      for (const double t : {0.0, 0.8, 2.5}) {
        mesh.vertices = moving_sheet(flat_sheet(cells).vertices, t);
        surface.move(mesh.vertices);
        for (int i = 0; i < 200; ++i) {
          Eigen::Vector3d query(uniform(random), uniform(random), uniform(random));
          if (i % 2) query = mesh.vertices.row(i % mesh.vertices.rows()).transpose() + 0.01 * query;
          const SurfacePoint nearest = surface.nearest(query);
          // Rounding of coordinates of order one.
          EXPECT_NEAR(nearest.distance, brute_force(query, mesh), 1e-12);
          EXPECT_EQ(surface.nearest(query, i % static_cast<int>(mesh.triangles.rows())).distance,
                    nearest.distance);
        }
      }
    }
  }
}

TEST(SurfaceDistance, PointLiesOnItsTriangleWhereItsWeightsSay) {
  const data::TriangleMesh mesh = flat_sheet(9);
  const data::Points positions = moving_sheet(mesh.vertices, 1.3);
  SurfaceDistance surface(mesh.triangles, mesh.vertices);
  surface.move(positions);
  const Eigen::Vector3d query(0.1, 0.2, 0.4);
  const SurfacePoint nearest = surface.nearest(query);
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  for (int k = 0; k < 3; ++k) {
    position += nearest.barycentric[k] * positions.row(mesh.triangles(nearest.triangle, k)).transpose();
  }
  EXPECT_NEAR((position - nearest.position).norm(), 0, 1e-15);
  EXPECT_NEAR(nearest.barycentric.sum(), 1, 1e-15);
  EXPECT_NEAR((query - nearest.position).norm(), nearest.distance, 1e-15);
}

TEST(SurfaceDistance, TrianglesWithoutAreaCountAsTheirEdges) {
  data::TriangleMesh mesh;
  mesh.vertices.resize(4, 3);
  mesh.vertices << 0, 0, 0, 1, 0, 0, 2, 0, 0, 0, 0, 0;
  mesh.triangles.resize(2, 3);
  mesh.triangles << 0, 1, 2, 0, 3, 1;
  const SurfaceDistance surface(mesh.triangles, mesh.vertices);
  EXPECT_NEAR(surface.nearest({1.5, 3, 0}).distance, 3, 1e-15);
  EXPECT_NEAR(surface.nearest({-3, 4, 0}).distance, 5, 1e-15);
}

}  // namespace
}  // namespace flash::sysid
