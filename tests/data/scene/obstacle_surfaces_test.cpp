#include "data/scene/obstacle_surfaces.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

namespace flash::data {
namespace {

using Eigen::Vector3d;

const Eigen::AlignedBox3d kAbout(Vector3d(0, 0, 0), Vector3d(0.3, 0.4, 0));

TriangleMesh only_surface(decltype(SceneObstacle::shape) shape, double time = 0) {
  Scene scene;
  scene.obstacles.push_back({"obstacle", std::move(shape), {}});
  return obstacle_surfaces(scene, time, kAbout).at(0);
}

SceneBox box_of(const Vector3d& size, Trajectory trajectory = {}) {
  SceneBox box;
  box.size = size;
  box.trajectory = std::move(trajectory);
  return box;
}

double largest_distance(const TriangleMesh& mesh, const std::function<double(const Vector3d&)>& distance) {
  double largest = 0;
  for (const auto& v : mesh.vertices.rowwise())
    largest = std::max(largest, std::abs(distance(v.transpose())));
  return largest;
}

Trajectory moved_up() {
  Trajectory trajectory{{0, 1}, {Eigen::Isometry3d::Identity(), Eigen::Isometry3d::Identity()}};
  trajectory.poses[1].translation() = Vector3d(0, 0, 2);
  return trajectory;
}

TEST(ObstacleSurfaces, LieOnTheObstacles) {
  const Vector3d axis = Vector3d(1, 2, -2) / 3, point(0.1, -0.2, 0.3);
  EXPECT_LT(largest_distance(only_surface(ScenePlane{point, axis}),
                             [&](const Vector3d& x) { return axis.dot(x - point); }),
            1e-12);
  EXPECT_LT(largest_distance(only_surface(SceneCylinder{point, axis, 0.05}),
                             [&](const Vector3d& x) { return axis.cross(x - point).norm() - 0.05; }),
            1e-12);
  EXPECT_LT(largest_distance(only_surface(SceneCapsule{point, axis, 0.04, 0.05, {}}),
                             [&](const Vector3d& x) {
                               const double along = std::clamp(axis.dot(x - point), -0.04, 0.04);
                               return (x - point - along * axis).norm() - 0.05;
                             }),
            1e-12);
  EXPECT_LT(
      largest_distance(only_surface(box_of({0.1, 0.2, 0.3})),
                       [&](const Vector3d& x) { return (x.cwiseAbs() - Vector3d(0.05, 0.1, 0.15)).norm(); }),
      1e-12);
}

TEST(ObstacleSurfaces, BoxesHaveTheirVolumeOutwards) {
  const TriangleMesh box = only_surface(box_of({0.1, 0.2, 0.3}));
  double volume = 0;
  for (const auto& t : box.triangles.rowwise()) {
    const Vector3d a = box.vertices.row(t[0]), b = box.vertices.row(t[1]), c = box.vertices.row(t[2]);
    volume += a.dot(b.cross(c)) / 6;
  }
  EXPECT_NEAR(volume, 0.1 * 0.2 * 0.3, 1e-15);
}

TEST(ObstacleSurfaces, WhatHasNoEndReachesPastTheBox) {
  const TriangleMesh plane = only_surface(ScenePlane{});
  for (int axis : {0, 1}) {
    EXPECT_LT(plane.vertices.col(axis).minCoeff(), kAbout.min()[axis]);
    EXPECT_GT(plane.vertices.col(axis).maxCoeff(), kAbout.max()[axis]);
  }
}

TEST(ObstacleSurfaces, StandWhereTheyAreAtTheTime) {
  EXPECT_NEAR(only_surface(box_of(Vector3d::Ones(), moved_up()), 0.5).vertices.col(2).mean(), 1, 1e-12);
  EXPECT_NEAR(only_surface(SceneCapsule{Vector3d::Zero(), Vector3d::UnitX(), 0, 0.1, moved_up()}, 1)
                  .vertices.col(2)
                  .mean(),
              2, 1e-12);
}

TEST(ObstacleSurfaces, OfOneObstacleStandInItsFrame) {
  SceneBox box = box_of(Vector3d::Ones());
  box.pose.translation() = Vector3d(3, 0, 0);
  EXPECT_NEAR(obstacle_surface({"resting", box, {}}, kAbout).vertices.col(0).mean(), 3, 1e-12);
  box.trajectory = moved_up();  // takes the place of the pose
  const TriangleMesh moving = obstacle_surface({"moving", box, {}}, kAbout);
  EXPECT_LT(moving.vertices.colwise().mean().norm(), 1e-12);
  EXPECT_EQ(moving.vertices, box_surface(Vector3d::Ones()).vertices);
}

TEST(ObstacleSurfaces, OfEndEffectorsThatCollideAreThereToo) {
  Scene scene;
  scene.end_effectors.resize(2);
  for (SceneEndEffector& effector : scene.end_effectors) effector.trajectory = moved_up();
  scene.end_effectors[1].collides = true;
  ASSERT_EQ(obstacle_surfaces(scene, 1, kAbout).size(), 1u);
  EXPECT_NEAR(obstacle_surfaces(scene, 1, kAbout)[0].vertices.col(2).mean(), 2, 1e-12);
  scene.end_effectors[1].name = "hand";
  scene.obstacles.push_back({"table", ScenePlane{}, {}});
  const std::vector<SceneObstacle> all = colliding(scene);
  ASSERT_EQ(all.size(), 2u);
  EXPECT_EQ(all[0].name, "table");
  EXPECT_EQ(all[1].name, "hand");
}

}  // namespace
}  // namespace flash::data
