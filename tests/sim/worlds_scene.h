#pragma once
// A sheet, its gripper and its poses, for tests of worlds.
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <memory>
#include <utility>
#include <vector>

#include "data/motion/trajectory.h"
#include "sim/worlds.h"
#include "tests/sim/sheet_scene.h"

namespace flash::sim {

constexpr double worlds_time_step = 0.01;  // [s]

/// The k-th pose of a gripper that lifts, carries and turns; through the numbers that a setter takes.
inline Eigen::Matrix<double, 7, 1> pose_numbers(int k) {
  const double t = worlds_time_step * k;
  const Eigen::Isometry3d pose = Eigen::Translation3d(0.3 * t, 0.1 * t * t, 0.5 * t * (1 - t)) *
                                 Eigen::AngleAxisd(2 * t, Eigen::Vector3d(1, 2, 3).normalized());
  return data::to_vector(pose);
}

/// A sheet on a table, whose gripper stands at a corner at the start: a hold that takes what is near, and one
/// that is open until it is asked to close. A peg goes with the gripper.
inline Environment on_a_table(const Sheet& sheet, double stiffness = 100) {
  Environment environment = environment_of(sheet);
  environment.materials[0].membrane_stiffness = stiffness;
  environment.obstacles.push_back({Plane{}});
  environment.obstacles.push_back({Box{.half_extents = {0.01, 0.01, 0.01},
                                       .pose = Eigen::Isometry3d(Eigen::Translation3d(-0.03, 0, 0.05))}});
  environment.obstacles.back().frame = 0;
  environment.holds = {
      {.name = "corner", .vertices = {0, 1}, .frame = 0},
      {.name = "gripper",
       .frame = 0,
       .from = std::numeric_limits<double>::infinity(),
       .reach =
           Reach{.object = "towel", .half_extents = Eigen::Vector3d::Constant(0.03), .threshold = 0.005}}};
  environment.schedule = std::make_shared<const Schedule>(
      Schedule{.start = 0, .time_step = worlds_time_step, .frames = {{data::from_vector(pose_numbers(0))}}});
  return environment;
}

/// The same with the poses of `steps` steps planned.
inline Environment planned(Environment environment, int steps) {
  Schedule schedule = *environment.schedule;
  for (int k = 1; k <= steps; ++k) schedule.frames[0].push_back(data::from_vector(pose_numbers(k)));
  environment.schedule = std::make_shared<const Schedule>(schedule);
  return environment;
}

inline Tensor tensor(const std::vector<double>& numbers, std::vector<std::int64_t> shape) {
  return {.data = numbers.data(), .shape = std::move(shape)};
}

/// Equal in every bit.
inline void expect_same(const State& a, const State& b) {
  EXPECT_EQ(a.positions, b.positions);
  EXPECT_EQ(a.velocities, b.velocities);
  EXPECT_EQ(a.bristles, b.bristles);
  EXPECT_EQ(a.time, b.time);
  EXPECT_TRUE(std::ranges::equal(a.pair_bristles, b.pair_bristles, [](const auto& p, const auto& q) {
    return p.vertices == q.vertices && p.edges == q.edges && p.share == q.share;
  }));
}

inline const State& state(const Worlds& worlds, int e) { return worlds.environment(e).state; }

}  // namespace flash::sim
