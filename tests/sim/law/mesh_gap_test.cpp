#include "sim/law/mesh_gap.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "sim/step/moving_obstacles.h"
#include "tests/sim/brute_surface.h"
#include "tests/sim/surface_shapes.h"

namespace flash::sim {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

/// The surface of a mesh has to outlive it.
MovingObstacle<double> at_rest(const Obstacle& obstacle) {
  Environment environment;
  environment.obstacles = {obstacle};
  return moving_obstacles(environment, 0, 0)[0];
}

/// The gap of a way, in a step of 10 ms from which things come out at 1 m/s.
Gap gap_of_way(const MovingObstacle<double>& obstacle, const Vector3d& from, const Vector3d& to,
               const Vector3d& way_out = Vector3d::Zero()) {
  return gap_of(
      gap_after(obstacle, {}, vector3(from), vector3(to), vector3(to), 0.01, {1.0, vector3(way_out)}));
}

Isometry3d random_pose() {
  return Isometry3d(Eigen::Translation3d(Vector3d::Random()) *
                    Eigen::AngleAxisd(3 * Vector3d::Random().x(), Vector3d::Random().normalized()));
}

/// The surfaces that differ, of a place at rest.
int surfaces_at(const Mesh& mesh, const Vector3d& place) {
  const MeshGaps gaps = gaps_after(*mesh.surface, mesh.margin, vector3(place), vector3(place), {});
  int count = 0;
  for (int k = 0; k < most_mesh_surfaces; ++k) {
    bool is_new = true;
    for (int j = 0; j < k; ++j) is_new = is_new && gaps.surfaces[j].triangle != gaps.surfaces[k].triangle;
    count += is_new;
  }
  return count;
}

TEST(MeshGap, ABoxOfTrianglesIsABox) {
  int inside = 0, through = 0;
  for (int sample = 0; sample < 4000; ++sample) {
    const Vector3d half = 0.02 * Vector3d::Ones() + 0.3 * Vector3d::Random().cwiseAbs();
    const Isometry3d pose = random_pose();
    const MovingObstacle<double> box = at_rest({Box{half, pose}});
    const Mesh mesh = mesh_shape(box_surface(half, 1 + sample % 3), 0, pose);
    const MovingObstacle<double> triangles = at_rest({mesh});
    // Half of the ways from about the box.
    const Vector3d reach = sample % 2 == 0 ? Vector3d(0.8 * Vector3d::Ones()) : Vector3d(1.2 * half);
    const Vector3d from = pose * Vector3d(reach.cwiseProduct(Vector3d::Random())),
                   to = pose * Vector3d(0.8 * Vector3d::Random());
    const Gap of_box = gap_of(gap_to(box, vector3(to))), of_mesh = gap_of(gap_to(triangles, vector3(to)));
    EXPECT_NEAR(of_mesh.distance, of_box.distance, 1e-12) << sample;
    EXPECT_NEAR((of_mesh.normal - of_box.normal).norm(), 0, 1e-6) << sample;
    const Gap way_to_box = gap_of_way(box, from, to), way_to_mesh = gap_of_way(triangles, from, to);
    EXPECT_NEAR(way_to_mesh.distance, way_to_box.distance, 1e-9) << sample;
    EXPECT_EQ(way_to_mesh.starts_inside, way_to_box.starts_inside) << sample;
    if (way_to_box.starts_inside) {
      EXPECT_NEAR(way_to_mesh.sunk, way_to_box.sunk, 1e-9) << sample;
    }
    inside += way_to_box.starts_inside;
    through += way_to_box.distance < -0.02;
  }
  EXPECT_GT(inside, 50);
  EXPECT_GT(through, 100);
}

TEST(MeshGap, NoWayPassesThroughABall) {
  // The rule of a sphere, to the height of the triangles over it: 2.5 mm of 0.3 m.
  const data::TriangleMesh mesh = ball_surface(0.3, 3);
  const Mesh shape = mesh_shape(mesh);
  const MovingObstacle<double> ball = at_rest({shape});
  int through = 0;
  for (int sample = 0; sample < 5000; ++sample) {
    const Vector3d from = Vector3d::Random(), to = Vector3d::Random();
    if (brute_winding(mesh, from) > 0.5) continue;
    const Gap gap = gap_of_way(ball, from, to);
    const double share = std::clamp(-from.dot(to - from) / (to - from).squaredNorm(), 0.0, 1.0);
    const double nearest = (from + share * (to - from)).norm();
    if (nearest > 0.301 && sample % 20 == 0) {
      EXPECT_NEAR(gap.distance, brute_distance(mesh, to), 1e-12) << sample;
    }
    // A way this deep leaves a third of the round from where it came in, and the triangles lean by 6 degrees.
    if (nearest > 0.5 * 0.3) continue;
    ++through;
    EXPECT_LT(gap.distance, 0) << sample;
    EXPECT_GT(gap.normal.dot(from), 0) << sample;
  }
  EXPECT_GT(through, 150);
}

TEST(MeshGap, NoWayPassesThroughAnOpenSurfaceFromEitherSide) {
  const data::TriangleMesh mesh = data::rectangle(
      {.width = 1, .height = 1, .cells_x = 5, .cells_y = 5, .pattern = data::DiagonalPattern::jittered});
  const double margin = 1e-3;
  const Mesh shape = mesh_shape(mesh, margin);
  const MovingObstacle<double> sheet = at_rest({shape});
  int through = 0;
  for (int sample = 0; sample < 5000; ++sample) {
    const Vector3d from = Vector3d(0.5, 0.5, 0) + Vector3d::Random(),
                   to = Vector3d(0.5, 0.5, 0) + Vector3d::Random();
    if (std::abs(from.z()) < 2 * margin) continue;
    const Gap gap = gap_of_way(sheet, from, to);
    const Vector3d crosses = from + from.z() / (from.z() - to.z()) * (to - from);
    if (from.z() * to.z() < 0 && (crosses.head<2>().array() > 0).all() &&
        (crosses.head<2>().array() < 1).all()) {
      ++through;
      EXPECT_NEAR(gap.distance, -std::abs(to.z()) - margin, 1e-12) << sample;
      EXPECT_NEAR(gap.normal.z(), from.z() > 0 ? 1 : -1, 1e-12) << sample;
    } else {
      EXPECT_NEAR(gap.distance, brute_distance(mesh, to) - margin, 1e-12) << sample;
    }
  }
  EXPECT_GT(through, 500);
}

TEST(MeshGap, SeamsOfASmoothSurfaceAreOneAndCreasesAreTwo) {
  // A plate in triangles, at their corners, their edges and within.
  const Mesh plate = mesh_shape(box_surface({0.1, 0.1, 0.01}, 4));
  for (int sample = 0; sample < 500; ++sample) {
    Vector3d place = 0.09 * Vector3d::Random();
    place.z() = 0.01;
    if (sample % 3 == 0) place.x() = 0.05;
    if (sample % 4 == 0) place.y() = place.x();
    EXPECT_EQ(surfaces_at(plate, place), 1) << sample;
  }
  // On its sharp edge and its corner, too, one is as good as the other.
  EXPECT_EQ(surfaces_at(plate, {0.1, 0.03, 0.01}), 1);
  EXPECT_EQ(surfaces_at(plate, {0.1, 0.1, 0.01}), 1);

  // A step: the crease between its floor and its wall, also above and beside by what rounding leaves.
  const Mesh step =
      mesh_shape(prism_surface({{-0.1, -0.1}, {0.1, -0.1}, {0.1, 0}, {0, 0}, {0, 0.1}, {-0.1, 0.1}}, 3, 0.1));
  for (const double off : {0.0, 1e-17, -1e-17, 1e-12}) {
    EXPECT_EQ(surfaces_at(step, {off, 0.02, 0}), 2) << off;
    EXPECT_EQ(surfaces_at(step, {0, 0.02, off}), 2) << off;
    EXPECT_EQ(surfaces_at(step, {off, 0.02, 0.03}), 1) << off;
    EXPECT_EQ(surfaces_at(step, {0.03, 0.02, off}), 1) << off;
  }
  // The same of two plates that reach into each other, which have no edge there.
  const Mesh crossed = mesh_shape(joined_surfaces(
      box_surface({0.1, 0.1, 0.01}),
      moved_surface(box_surface({0.01, 0.08, 0.1}), Isometry3d(Eigen::Translation3d(0, 0, 0.1)))));
  EXPECT_EQ(surfaces_at(crossed, {0.01, 0.02, 0.01}), 2);
  EXPECT_EQ(surfaces_at(crossed, {0.05, 0.02, 0.01}), 1);
  // A corner of three.
  const Mesh room = mesh_shape(joined_surfaces(
      joined_surfaces(
          box_surface({0.1, 0.1, 0.01}),
          moved_surface(box_surface({0.01, 0.08, 0.1}), Isometry3d(Eigen::Translation3d(0, 0, 0.1)))),
      moved_surface(box_surface({0.08, 0.01, 0.1}), Isometry3d(Eigen::Translation3d(0, 0, 0.1)))));
  EXPECT_EQ(surfaces_at(room, {0.01, 0.01, 0.01}), 3);
}

TEST(MeshGap, AVertexInACreaseIsKeptByBothOfItsSides) {
  const Mesh step =
      mesh_shape(prism_surface({{-0.1, -0.1}, {0.1, -0.1}, {0.1, 0}, {0, 0}, {0, 0.1}, {-0.1, 0.1}}, 3, 0.1));
  for (int sample = 0; sample < 1000; ++sample) {
    const Vector3d from(0, 0.05 * Vector3d::Random().x(), 0), way = 0.05 * Vector3d::Random();
    const Gap gap = gap_of_way(at_rest({step}), from, from + way);
    const double least = std::min(way.x(), way.z());
    if (least > 0) {
      EXPECT_GT(gap.distance, 0) << sample;
    } else {
      EXPECT_LT(gap.distance, 0) << sample;
      // What is behind both is put out into the crease.
      EXPECT_GE(gap.distance, -std::hypot(std::min(0.0, way.x()), std::min(0.0, way.z())) - 1e-9) << sample;
    }
  }
}

TEST(MeshGap, WhatLiesWithinAnotherPartIsNotMet) {
  // A plate of 4 mm within one of 6 mm: a way from above ends on the top of the inner one, or a little below.
  const Mesh plates =
      mesh_shape(joined_surfaces(box_surface({0.1, 0.1, 0.002}), box_surface({0.08, 0.08, 0.003})));
  for (const double end : {0.0025, 0.002 + 1e-18, 0.002, 0.002 - 1e-18, 0.0019, -0.001, -0.01}) {
    const Gap gap = gap_of_way(at_rest({plates}), {0.01, 0.02, 0.1}, {0.012, 0.017, end});
    EXPECT_NEAR(gap.distance, end - 0.003, 1e-15) << end;
    EXPECT_NEAR(gap.normal.z(), 1, 1e-15) << end;
  }
}

TEST(MeshGap, AMovingMeshIsMetAsOneAtRestIsInItsFrame) {
  for (int sample = 0; sample < 300; ++sample) {
    const Mesh mesh = mesh_shape(ball_surface(0.3, 1), sample % 2 == 0 ? 0 : 0.01);
    MovingObstacle<double> still = at_rest({mesh}), moving = still;
    const Isometry3d start = random_pose(), end = random_pose();
    moving.start = frame_of(start);
    moving.end = frame_of(end);
    moving.moves = true;
    const Vector3d from = Vector3d::Random(), to = Vector3d::Random();
    const Gap expected = gap_of_way(still, from, to), gap = gap_of_way(moving, start * from, end * to);
    EXPECT_NEAR(gap.distance, expected.distance, 1e-12) << sample;
    EXPECT_NEAR((gap.normal - end.linear() * expected.normal).norm(), 0, 1e-9) << sample;
    EXPECT_NEAR((gap.surface_moved - (end * to - start * to)).norm(), 0, 1e-12) << sample;
    EXPECT_NEAR(gap.sunk, expected.sunk, 1e-12) << sample;
  }
}

TEST(MeshGap, AMarginRoundsEdgesAndCorners) {
  const double margin = 0.02, step = 1e-5;
  const Mesh rounded = mesh_shape(box_surface({0.1, 0.2, 0.3}, 2), margin),
             pointed = mesh_shape(box_surface({0.1, 0.2, 0.3}, 2));
  const MovingObstacle<double> box = at_rest({rounded}), sharp = at_rest({pointed});
  int edges = 0, corners = 0;
  for (int sample = 0; sample < 2000; ++sample) {
    const Vector3d point = 0.5 * Vector3d::Random(), along = Vector3d::Random().normalized();
    const auto distance = [&](double s) {
      return gap_to(box, vector3(Vector3d(point + s * along))).distance;
    };
    const Gap gap = gap_of(gap_to(box, vector3(point)));
    EXPECT_NEAR(gap.distance, gap_to(sharp, vector3(point)).distance - margin, 1e-14);
    const Vector3d beyond = (point.cwiseAbs() - Vector3d(0.1, 0.2, 0.3)).cwiseMax(0);
    // Second derivatives away from where faces, edges and corners meet.
    if (gap.distance < 0 || (beyond.array() > 0 && beyond.array() < 2 * step).any() ||
        ((point.cwiseAbs() - Vector3d(0.1, 0.2, 0.3)).array().abs() < 2 * step).any())
      continue;
    const double second = (distance(step) - 2 * distance(0) + distance(-step)) / (step * step);
    const double of_ball = gap.ball_curvature * (1 - std::pow(gap.normal.dot(along), 2));
    // Rounding of 1e-16 over the square of the step, and the fourth derivative.
    EXPECT_NEAR(std::pow(gap.curvature_direction.dot(along), 2) + of_ball, second, 1e-4) << sample;
    edges += gap.curvature_direction.norm() > 0;
    corners += gap.ball_curvature > 0;
  }
  EXPECT_GT(edges, 100);
  EXPECT_GT(corners, 100);
}

TEST(MeshGap, WhatStartsInsideLeavesByTheNearestSideOrAsOne) {
  const Mesh shape = mesh_shape(ball_surface(0.3, 3));
  const MovingObstacle<double> ball = at_rest({shape});
  for (int sample = 0; sample < 500; ++sample) {
    const Vector3d place = 0.25 * Vector3d::Random().normalized();
    const double depth = -gap_to(ball, vector3(place)).distance;
    const Gap own = gap_of_way(ball, place, place);
    EXPECT_TRUE(own.starts_inside);
    // In the step of 10 ms the surface rises by 1 cm.
    EXPECT_NEAR(own.sunk, depth - 0.01, 1e-12);
    EXPECT_NEAR(own.distance, -0.01, 1e-12);
    const Vector3d out = Vector3d::UnitZ();
    const Gap as_one = gap_of_way(ball, place, place, out);
    EXPECT_NEAR((as_one.normal - out).norm(), 0, 1e-12);
    const double along = depth_along(ball, vector3(place), vector3(out));
    EXPECT_NEAR(gap_to(ball, vector3(Vector3d(place + along * out))).distance, 0, 1e-9);
    EXPECT_NEAR(as_one.sunk, along - 0.01, 1e-12);
  }
}

}  // namespace
}  // namespace flash::sim
