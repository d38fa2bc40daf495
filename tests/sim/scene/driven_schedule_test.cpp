#include "sim/scene/driven_schedule.h"

#include <gtest/gtest.h>

namespace flash::sim {
namespace {

using Eigen::Isometry3d;

Isometry3d at(double x) { return Isometry3d(Eigen::Translation3d(x, 0, 0)); }

std::shared_ptr<const Schedule> plan_of_two() {
  return std::make_shared<const Schedule>(
      Schedule{.start = 1, .time_step = 0.5, .frames = {{at(0), at(1)}, {at(7)}}});
}

TEST(DrivenSchedule, FramesFollowThePlanUntilTheyAreGivenPoses) {
  DrivenSchedule driven(plan_of_two(), 1.0, 0.5);
  driven.begin_step(1.0);
  const Schedule& poses = *driven.schedule();
  EXPECT_EQ(pose_at(poses, 0, 1.0).matrix(), at(0).matrix());
  EXPECT_EQ(pose_at(poses, 0, 1.25).matrix(), at(0.5).matrix());
  EXPECT_EQ(pose_at(poses, 0, 1.5).matrix(), at(1).matrix());
  driven.set(1, at(9));
  EXPECT_EQ(pose_at(poses, 1, 1.5).matrix(), at(7).matrix());  // from the next step on
  driven.begin_step(1.5);
  EXPECT_EQ(pose_at(poses, 1, 1.5).matrix(), at(7).matrix());
  EXPECT_EQ(pose_at(poses, 1, 1.75).matrix(), at(8).matrix());
  EXPECT_EQ(pose_at(poses, 1, 2.0).matrix(), at(9).matrix());
  EXPECT_EQ(pose_at(poses, 0, 2.0).matrix(), at(1).matrix());  // the plan's last one stays
  driven.begin_step(2.0);
  EXPECT_EQ(pose_at(poses, 1, 2.0).matrix(), at(9).matrix());
  EXPECT_EQ(pose_at(poses, 1, 2.5).matrix(), at(9).matrix());
}

// A time that is a sum of steps strays from their product: by more than pose_at allows after a day.
TEST(DrivenSchedule, PosesStayExactHoweverLongItGoesOn) {
  const double h = 0.01;
  DrivenSchedule driven(plan_of_two(), 1.0, h);
  double time = 1.0;
  long inexact = 0;
  for (int k = 0; k < 2'000'000; ++k, time += h) {
    driven.set(0, at(k));
    driven.begin_step(time);
    const Schedule& poses = *driven.schedule();
    if (k > 0) inexact += pose_at(poses, 0, time).translation().x() != k - 1;
    inexact += pose_at(poses, 0, time + h).translation().x() != k;
  }
  EXPECT_GT(std::abs(time - 1.0 - 2e6 * h), 1e-6 * h);
  EXPECT_EQ(inexact, 0);
}

TEST(DrivenSchedule, ACopyGoesItsOwnWay) {
  DrivenSchedule driven(plan_of_two(), 1.0, 0.5), copy = driven;
  copy.own_poses();
  driven.set(0, at(5));
  driven.begin_step(1.0);
  copy.begin_step(1.0);
  EXPECT_EQ(pose_at(*driven.schedule(), 0, 1.5).matrix(), at(5).matrix());
  EXPECT_EQ(pose_at(*copy.schedule(), 0, 1.5).matrix(), at(1).matrix());
}

}  // namespace
}  // namespace flash::sim
