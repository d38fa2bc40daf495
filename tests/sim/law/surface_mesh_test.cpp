#include "sim/law/surface_mesh.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/sim/brute_surface.h"
#include "tests/sim/surface_shapes.h"

namespace flash::sim {
namespace {

using Eigen::Vector3d;

Vector3<double> vector(const Vector3d& v) { return {v.x(), v.y(), v.z()}; }
Vector3d vector(const Vector3<double>& v) { return {v.x, v.y, v.z}; }

/// A ball with hills and valleys, and a smaller one that it holds apart.
data::TriangleMesh rough_ball() {
  data::TriangleMesh mesh = ball_surface(1, 3);
  for (auto row : mesh.vertices.rowwise())
    row *= 1 + 0.2 * std::sin(7 * row.x()) * std::sin(5 * row.y()) + 0.1 * std::cos(9 * row.z());
  return joined_surfaces(
      mesh, moved_surface(ball_surface(0.2, 1), Eigen::Isometry3d(Eigen::Translation3d(1.6, 0, 0))));
}

TEST(SurfaceMesh, TheNearestPlaceIsThatOfAllTriangles) {
  const data::TriangleMesh mesh = rough_ball();
  const SurfaceMesh surface = make_surface_mesh(data::checked_obstacle_mesh(mesh, "ball"));
  EXPECT_TRUE(surface.closed);
  for (int sample = 0; sample < 2000; ++sample) {
    const Vector3d point = 2 * Vector3d::Random();
    const SurfacePlace place = nearest_on(surface, vector(point));
    EXPECT_NEAR(place.distance, brute_distance(mesh, point), 1e-14) << sample;
    EXPECT_NEAR((vector(place.point) - point).norm(), place.distance, 1e-14) << sample;
  }
}

TEST(SurfaceMesh, ThePseudonormalTellsInsideFromOutside) {
  // Also where a corner or an edge is nearest, as close to sharp ones.
  data::TriangleMesh spikes = ball_surface(1, 2);
  for (Eigen::Index i = 0; i < spikes.vertices.rows(); ++i) spikes.vertices.row(i) *= i % 3 == 0 ? 1.5 : 0.7;
  for (const data::TriangleMesh& mesh : {rough_ball(), spikes}) {
    const SurfaceMesh surface = make_surface_mesh(data::checked_obstacle_mesh(mesh, "ball"));
    int inside = 0, on_corners = 0;
    for (int sample = 0; sample < 4000; ++sample) {
      const int corner = sample % static_cast<int>(mesh.vertices.rows());
      const Vector3d point =
          sample % 2 == 0 ? Vector3d(2 * Vector3d::Random())
                          : Vector3d(mesh.vertices.row(corner).transpose() + 0.05 * Vector3d::Random());
      const SurfacePlace place = nearest_on(surface, vector(point));
      if (place.distance < 1e-9) continue;
      const bool out = dot(pseudonormal(surface, place), vector(point) - place.point) > 0;
      const double winding = brute_winding(mesh, point);
      EXPECT_NEAR(winding, out ? 0 : 1, 1e-6) << sample;
      inside += !out;
      on_corners += place.feature == SurfaceFeature::corner;
    }
    EXPECT_GT(inside, 500);
    EXPECT_GT(on_corners, 100);
  }
}

TEST(SurfaceMesh, EveryCrossingOfAWayIsFound) {
  const data::TriangleMesh mesh = rough_ball();
  const SurfaceMesh surface = make_surface_mesh(data::checked_obstacle_mesh(mesh, "ball"));
  int found = 0;
  for (int sample = 0; sample < 3000; ++sample) {
    const Vector3d from = 2 * Vector3d::Random(), to = 2 * Vector3d::Random();
    const std::vector<SurfaceCrossing> crossings = crossings_of(surface, vector(from), vector(to));
    const std::vector<BruteCrossing> expected = brute_crossings(mesh, from, to);
    ASSERT_EQ(crossings.size(), expected.size()) << sample;
    for (std::size_t k = 0; k < expected.size(); ++k)
      EXPECT_NEAR(crossings[k].share, expected[k].share, 1e-10) << sample;
    found += static_cast<int>(expected.size());
  }
  EXPECT_GT(found, 1000);
}

TEST(SurfaceMesh, NoWayGetsThroughASeamOrACorner) {
  // Ways that aim at edges and corners, to the last digit: into the ball they cross it at least once.
  const data::TriangleMesh mesh = ball_surface(1, 2);
  const SurfaceMesh surface = make_surface_mesh(data::checked_obstacle_mesh(mesh, "ball"));
  for (int sample = 0; sample < 20000; ++sample) {
    const auto t = mesh.triangles.row(sample % mesh.triangles.rows());
    const Vector3d a = mesh.vertices.row(t[0]), b = mesh.vertices.row(t[1]);
    const double share = sample % 5 == 0 ? 0 : 0.5 * (1 + Vector3d::Random().x());
    const Vector3d aim = a + share * (b - a), from = 3 * Vector3d::Random().normalized();
    // On beyond the place by as much as there is room within.
    const Vector3d to = aim - 0.3 * aim;
    if ((from - aim).dot(aim) < 0.1) continue;
    const Vector3d straight = from + (aim - from) * 1.05;
    for (const Vector3d& end : {to, straight}) {
      if (brute_winding(mesh, end) < 0.5) continue;
      EXPECT_FALSE(crossings_of(surface, vector(from), vector(end)).empty()) << sample;
    }
  }
}

TEST(SurfaceMesh, TheHierarchyIsTheSameEachTime) {
  const data::ObstacleMesh mesh = data::checked_obstacle_mesh(rough_ball(), "ball");
  const SurfaceMesh first = make_surface_mesh(mesh), again = make_surface_mesh(mesh);
  EXPECT_EQ(first.order, again.order);
  std::vector<int> all = first.order;
  std::sort(all.begin(), all.end());
  for (int k = 0; k < first.size(); ++k) EXPECT_EQ(all[k], k);
}

}  // namespace
}  // namespace flash::sim
