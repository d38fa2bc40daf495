#include "sim/law/contact_way.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "sim/step/moving_obstacles.h"

namespace flash::sim {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

Isometry3d random_pose() {
  return Isometry3d(Eigen::Translation3d(Vector3d::Random()) *
                    Eigen::AngleAxisd(3 * Vector3d::Random().x(), Vector3d::Random().normalized()));
}

/// The gap of a way without other obstacles, in a step of 10 ms from which things come out at 1 m/s.
Gap gap_of_way(const MovingObstacle<double>& obstacle, const Vector3d& from, const Vector3d& to) {
  return gap_of(gap_after(obstacle, {}, vector3(from), vector3(to), vector3(to), 0.01, {.speed = 1}));
}

MovingObstacle<double> at_rest(const Obstacle& obstacle) {
  Environment environment;
  environment.obstacles = {obstacle};
  return moving_obstacles(environment, 0, 0)[0];
}

TEST(ContactWay, WaysThroughABoxEndAgainstTheFaceTheyEnteredBy) {
  int through = 0;
  for (int sample = 0; sample < 20000; ++sample) {
    const Box box{.half_extents = 0.02 * Vector3d::Ones() + 0.3 * Vector3d::Random().cwiseAbs()};
    const Isometry3d start = random_pose(), end = random_pose();
    MovingObstacle<double> moving = at_rest({box});
    moving.start = frame_of(start);
    moving.end = frame_of(end);
    moving.moves = true;
    const Vector3d from = 0.8 * Vector3d::Random(), to = 0.8 * Vector3d::Random();
    if ((from.cwiseAbs() - box.half_extents).maxCoeff() < 0) continue;
    // Brute force: the faces through which the straight way, seen from the box, goes in and out.
    int in = -1, out = -1;
    bool by_an_edge = false;
    double in_sign = 0;
    constexpr int parts = 4000;
    for (int k = 1; k <= parts; ++k) {
      const auto excess = [&](int part) {
        const Vector3d at = from + double(part) / parts * (to - from);
        return Vector3d(at.cwiseAbs() - box.half_extents);
      };
      const Vector3d before = excess(k - 1), now = excess(k);
      // By an edge: which face is for chance to say.
      by_an_edge = by_an_edge || (before.maxCoeff() * now.maxCoeff() <= 0 &&
                                  ((before.array() > 0) != (now.array() > 0)).count() > 1);
      if (before.maxCoeff() > 0 && now.maxCoeff() <= 0) {
        before.maxCoeff(&in);
        in_sign = std::copysign(1.0, (from + double(k) / parts * (to - from))[in]);
      }
      if (before.maxCoeff() <= 0 && now.maxCoeff() > 0) now.maxCoeff(&out);
    }
    if (by_an_edge) continue;
    const Gap gap = gap_of_way(moving, start * from, end * to);
    const bool ends_inside = (to.cwiseAbs() - box.half_extents).maxCoeff() <= 0;
    if (in < 0 || (!ends_inside && out != in)) {
      // Never in, or out by a face beside: the distance of the point alone.
      if (in < 0) {
        EXPECT_GE(gap.distance, 0) << sample;
      }
      continue;
    }
    ++through;
    EXPECT_NEAR(gap.distance, in_sign * to[in] - box.half_extents[in], 1e-9) << sample;
    EXPECT_LT(gap.distance, 0) << sample;
    EXPECT_NEAR((gap.normal - in_sign * end.linear().col(in)).norm(), 0, 1e-9) << sample;
  }
  EXPECT_GT(through, 500);
}

TEST(ContactWay, NoWayPassesThroughACylinder) {
  int through = 0;
  for (int sample = 0; sample < 20000; ++sample) {
    const Cylinder cylinder{Vector3d::Zero(), Vector3d::UnitY(), 0.3};
    const Vector3d from = Vector3d::Random(), to = Vector3d::Random();
    const auto across = [](const Vector3d& x) { return Vector3d(x.x(), 0, x.z()); };
    if (across(from).norm() < 0.3) continue;
    double nearest = 1;
    for (int k = 0; k <= 1000; ++k)
      nearest = std::min(nearest, across(from + k / 1000.0 * (to - from)).norm());
    const Gap gap = gap_of_way(at_rest({cylinder}), from, to);
    if (nearest > 0.301) {
      EXPECT_GT(gap.distance, 0) << sample;
    }
    // A way this deep leaves more than a quarter of the round from where it came in.
    if (nearest > 0.3 / std::sqrt(2.0) || across(to).norm() < 0.3) continue;
    ++through;
    EXPECT_LT(gap.distance, 0) << sample;
    EXPECT_GE(across(to - gap.distance * gap.normal).norm(), 0.3 - 1e-9) << sample;
    EXPECT_GT(gap.normal.dot(from), 0) << sample;
  }
  EXPECT_GT(through, 1000);
}

/// The place on the axis of a capsule about the origin, along y, nearest to a point.
Vector3d on_axis(double half_length, const Vector3d& x) {
  return {0, std::clamp(x.y(), -half_length, half_length), 0};
}

TEST(ContactWay, NoWayPassesThroughACapsule) {
  for (const double half_length : {0.0, 0.02, 0.6}) {
    const double radius = 0.3;
    const MovingObstacle<double> capsule =
        at_rest({Capsule{Vector3d::Zero(), Vector3d::UnitY(), half_length, radius}});
    int through = 0, beside = 0, rounded = 0;
    for (int sample = 0; sample < 10000; ++sample) {
      const Vector3d from = Vector3d::Random(), to = Vector3d::Random();
      const auto out_of_axis = [&](const Vector3d& x) { return Vector3d(x - on_axis(half_length, x)); };
      if (out_of_axis(from).norm() < radius) continue;
      const Gap gap = gap_of_way(capsule, from, to);
      int in = -1;
      for (int k = 0; k <= 1000 && in < 0; ++k)
        if (out_of_axis(from + k / 1000.0 * (to - from)).norm() < radius) in = k;
      if (in < 0) {
        // Beside it, or in by less than the parts of the way can tell.
        EXPECT_NEAR(gap.distance, out_of_axis(to).norm() - radius, 1e-12) << sample;
        ++beside;
        continue;
      }
      const Vector3d entered = from + in / 1000.0 * (to - from), middle = on_axis(half_length, entered);
      const Vector3d normal = (entered - middle).normalized();
      const double height = normal.dot(to - middle);
      // A part of the way, 3.5 mm at most, turns the normal by 0.012, which moves the height of a place 3 m
      // away by 0.04 m.
      if (height < -0.04) {
        // Behind where it came in: against the tangent plane there.
        ++through;
        EXPECT_NEAR(gap.distance, height - radius, 0.04) << sample;
        EXPECT_GT(gap.normal.dot(normal), 0.99) << sample;
        EXPECT_GE(out_of_axis(to - gap.distance * gap.normal).norm(), radius - 1e-9) << sample;
      } else if (height > 0.04) {
        ++rounded;
        EXPECT_NEAR(gap.distance, out_of_axis(to).norm() - radius, 1e-12) << sample;
      }
    }
    EXPECT_GT(through, 300);
    EXPECT_GT(beside, 300);
    EXPECT_GT(rounded, 30);
  }
}

TEST(ContactWay, ALongCapsuleIsMetAsACylinder) {
  const Vector3d axis = Vector3d(1, 2, 2) / 3;
  const MovingObstacle<double> cylinder = at_rest({Cylinder{Vector3d::Zero(), axis, 0.3}}),
                               capsule = at_rest({Capsule{Vector3d::Zero(), axis, 100, 0.3}});
  for (int sample = 0; sample < 5000; ++sample) {
    const Vector3d from = Vector3d::Random(), to = Vector3d::Random();
    const Gap expected = gap_of_way(cylinder, from, to), gap = gap_of_way(capsule, from, to);
    EXPECT_NEAR(gap.distance, expected.distance, 1e-12);
    EXPECT_NEAR((gap.normal - expected.normal).norm(), 0, 1e-9);
    EXPECT_NEAR((gap.curvature_direction - expected.curvature_direction).norm(), 0, 1e-6);
    EXPECT_EQ(gap.ball_curvature, 0);
    EXPECT_NEAR(gap.sunk, expected.sunk, 1e-12);
  }
}

TEST(ContactWay, WhatStartsInsideMayStayThereForItsWayOut) {
  Box box{.half_extents = {0.1, 0.1, 0.05}};
  const Obstacle obstacles[] = {{Plane{Vector3d(0, 0, 0.05)}},
                                {box},
                                {Cylinder{Vector3d::Zero(), Vector3d::UnitY(), 0.05}},
                                {Capsule{Vector3d::Zero(), Vector3d::UnitX(), 0.1, 0.05}},
                                {Capsule{Vector3d::Zero(), Vector3d::UnitZ(), 0, 0.05}}};
  for (const Obstacle& obstacle : obstacles) {
    const Vector3d start(0, 0, 0.02);  // 30 mm deep, 10 mm a step
    const Gap gap = gap_of_way(at_rest(obstacle), start, start);
    EXPECT_NEAR(gap.sunk, 0.02, 1e-12);
    EXPECT_NEAR(gap.distance, -0.01, 1e-12);
    EXPECT_NEAR((gap.normal - Vector3d::UnitZ()).norm(), 0, 1e-12);
    EXPECT_NEAR(gap_of_way(at_rest(obstacle), Vector3d(0, 0, 0.045), start).sunk, 0, 1e-12);
  }
}

TEST(ContactWay, AMovingObstacleIsMetAsOneAtRestIsInItsFrame) {
  const Obstacle obstacles[] = {{Plane{Vector3d(0.1, 0, 0), Vector3d(1, 2, 2).normalized()}},
                                {Box{.half_extents = {0.3, 0.2, 0.1}}},
                                {Cylinder{Vector3d(0, 0.1, 0), Vector3d(2, 1, 2).normalized(), 0.3}},
                                {Capsule{Vector3d(0, 0.1, 0), Vector3d(2, 1, 2).normalized(), 0.2, 0.3}},
                                {Capsule{Vector3d(0, 0.1, 0), Vector3d::UnitX(), 0, 0.3}}};
  for (const Obstacle& obstacle : obstacles)
    for (int sample = 0; sample < 2000; ++sample) {
      const Isometry3d start = random_pose(), end = random_pose();
      const MovingObstacle<double> still = at_rest(obstacle);
      Environment environment;
      environment.obstacles = {obstacle};
      environment.obstacles[0].frame = 0;
      environment.schedule = std::make_shared<const Schedule>(Schedule{0, 1, {{start, end}}});
      const MovingObstacle<double> moving = moving_obstacles(environment, 0, 1)[0];
      const Vector3d from = 0.5 * Vector3d::Random(), to = 0.5 * Vector3d::Random();
      const Gap expected = gap_of_way(still, from, to), gap = gap_of_way(moving, start * from, end * to);
      EXPECT_NEAR(gap.distance, expected.distance, 1e-12);
      EXPECT_NEAR((gap.normal - end.linear() * expected.normal).norm(), 0, 1e-12);
      EXPECT_NEAR((gap.surface_moved - (end * to - start * to)).norm(), 0, 1e-12);
      EXPECT_NEAR(gap.sunk, expected.sunk, 1e-12);
    }
}

}  // namespace
}  // namespace flash::sim
