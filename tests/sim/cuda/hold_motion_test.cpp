// What holds do over a step, as a device is told of it.
#include "sim/cuda/hold_motion.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <vector>

#include "tests/sim/worlds_scene.h"

namespace flash::sim::cuda {
namespace {

using Eigen::Vector3d;

/// A gripper that goes on and turns by `turn` [rad] in one step, about an axis that no coordinate is.
std::shared_ptr<const Schedule> turning(double turn) {
  const Vector3d axis = Vector3d(1, 2, 3).normalized();
  const Eigen::Isometry3d from = Eigen::Translation3d(0.1, 0, 0.2) * Eigen::AngleAxisd(0.3, axis),
                          to = Eigen::Translation3d(0.12, 0.01, 0.2) * Eigen::AngleAxisd(0.3 + turn, axis);
  return std::make_shared<const Schedule>(
      Schedule{.start = 0, .time_step = worlds_time_step, .frames = {{from, to}}});
}

Vector3d place_at(const Vector3d& from, const Vector3d& target, const Vector3d& bow, double share) {
  return from + share * (target - from) + share * (1 - share) * bow;
}

// Exact in the middle; elsewhere by less than a hundredth of the radius times the cube of the turn.
TEST(HoldMotion, HeldVerticesGoAlongTheArcOfTheirFrame) {
  const Sheet sheet = small_sheet();
  for (const double turn : {0.0, 0.02, 0.2, 1.0}) {
    Environment environment = on_a_table(sheet);
    environment.schedule = turning(turn);
    const HoldMotion motion = motion_of_holds(environment, worlds_time_step, 1);
    ASSERT_EQ(motion.front().size(), 2U);
    const data::Points offsets = environment.state.held[0].offsets;
    for (std::size_t v = 0; v < 2; ++v) {
      const HeldVertex& held = motion.front()[v];
      const Vector3d offset = offsets.row(static_cast<Eigen::Index>(v)).transpose();
      const auto exact = [&](double share) -> Vector3d {
        return frame_pose(environment, 0, share * worlds_time_step) * offset;
      };
      for (int k = 0; k <= 16; ++k) {
        const double share = k / 16.0;
        const double off = (place_at(exact(0), held.target, held.bow, share) - exact(share)).norm();
        EXPECT_LE(off, (k % 8 == 0 ? 0 : 0.01 * offset.norm() * std::pow(turn, 3)) + 1e-15)
            << turn << ' ' << k;
      }
    }
  }
}

TEST(HoldMotion, SpringsDoSoToo) {
  const Sheet sheet = small_sheet();
  Environment environment = on_a_table(sheet);
  constexpr double turn = 0.2;
  environment.schedule = turning(turn);
  environment.holds[0].stiffness = Eigen::VectorXd::Constant(2, 100);
  Environment there = environment;
  update_holds(there, worlds_time_step);
  const auto motion = motion_of_springs(environment, worlds_time_step, 1);
  ASSERT_TRUE(motion);
  ASSERT_EQ(motion->front().size(), 2U);
  for (std::size_t v = 0; v < 2; ++v) {
    const SpringMotion& spring = motion->front()[v];
    const Vector3d offset = there.state.held[0].offsets.row(static_cast<Eigen::Index>(v)).transpose();
    for (const double share : {0.0, 0.25, 0.5, 1.0}) {
      const Vector3d exact = frame_pose(environment, 0, share * worlds_time_step) * offset;
      EXPECT_LE((place_at(spring.from, spring.to, spring.bow, share) - exact).norm(),
                0.01 * offset.norm() * std::pow(turn, 3) + 1e-15);
    }
  }
}

}  // namespace
}  // namespace flash::sim::cuda
