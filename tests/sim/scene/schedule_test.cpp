#include "sim/scene/schedule.h"

#include <gtest/gtest.h>

#include <stdexcept>

namespace flash::sim {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

/// A quarter turn about z and a way along x from 0.1 s to 0.3 s.
data::Trajectory turning_path() {
  data::Trajectory trajectory;
  for (const double share : {0.0, 1.0}) {
    Isometry3d pose = Isometry3d::Identity();
    pose.translation() = Vector3d(share, 0, 0);
    pose.linear() = Eigen::AngleAxisd(share * EIGEN_PI / 2, Vector3d::UnitZ()).toRotationMatrix();
    trajectory.times.push_back(0.1 + 0.2 * share);
    trajectory.poses.push_back(pose);
  }
  return trajectory;
}

TEST(Schedule, IsTheTrajectoryAtTheEndsOfSteps) {
  const std::vector<data::Trajectory> trajectories = {turning_path(), {}};
  const auto schedule = make_schedule(trajectories, -0.05, 0.01, 50);
  double time = -0.05;  // as a simulation adds it up
  for (int k = 0; k <= 50; ++k, time += 0.01) {
    const Isometry3d expected = data::pose_at(trajectories[0], -0.05 + k * 0.01);
    EXPECT_EQ(pose_at(*schedule, 0, time).matrix(), expected.matrix()) << k;
    EXPECT_TRUE(pose_at(*schedule, 1, time).matrix().isIdentity(0)) << k;  // nobody says that it moves
  }
}

TEST(Schedule, TurnsAndMovesEvenlyBetweenTwoSteps) {
  const data::Trajectory path = turning_path();
  const auto schedule = make_schedule({&path, 1}, 0.1, 0.2, 1);
  const Isometry3d pose = pose_at(*schedule, 0, 0.15);
  EXPECT_NEAR(pose.translation().x(), 0.25, 1e-15);
  EXPECT_NEAR(Eigen::AngleAxisd(pose.linear()).angle(), EIGEN_PI / 8, 1e-12);
}

TEST(Schedule, StandsStillBeforeItsStartAndAfterItsEnd) {
  const data::Trajectory path = turning_path();
  const auto schedule = make_schedule({&path, 1}, 0.2, 0.01, 1000);
  EXPECT_EQ(pose_at(*schedule, 0, 0).matrix(), pose_at(*schedule, 0, 0.2).matrix());
  EXPECT_EQ(pose_at(*schedule, 0, 99).translation(), Vector3d(1, 0, 0));
  EXPECT_LE(schedule->frames[0].size(), 12u);  // the rest takes no memory
  EXPECT_THROW(pose_at(*schedule, 1, 0), std::out_of_range);
}

}  // namespace
}  // namespace flash::sim
