#include "sysid/observe/score.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/sysid/moving_sheet.h"

namespace flash::sysid {
namespace {

TEST(Objective, TrimmedMeanLeavesOutTheLargestShare) {
  std::vector<double> distances;
  for (int i = 1; i <= 19; ++i) distances.push_back(20 - i);
  distances.push_back(1e6);
  EXPECT_DOUBLE_EQ(robust_mean(distances, {.kind = RobustKind::trimmed, .trim_fraction = 0.05}), 10);
}

TEST(Objective, HuberGrowsAsTheRootBeyondDeltaAndMeetsThePlainMeanBelow) {
  std::vector<double> small = {0.01, 0.02}, large = {0.1};
  const Robust huber{.kind = RobustKind::huber, .huber_delta = 0.02};
  EXPECT_DOUBLE_EQ(robust_mean(small, huber), 0.015);
  EXPECT_DOUBLE_EQ(robust_mean(large, huber), std::sqrt(0.02 * (0.2 - 0.02)));
}

TEST(Objective, MotionIsLinearBetweenStepsAndHeldOutside) {
  const data::TriangleMesh mesh = flat_sheet(2);
  const Motion motion = moving_sheet_motion(mesh, 0.1, 3);
  data::Points positions, velocities;
  surface_at(motion, 0.125, positions, &velocities);
  EXPECT_NEAR((positions - (0.75 * motion.positions[1] + 0.25 * motion.positions[2])).norm(), 0, 1e-14);
  EXPECT_NEAR((velocities - (motion.positions[2] - motion.positions[1]) / 0.1).norm(), 0, 1e-12);
  surface_at(motion, 9, positions, &velocities);
  EXPECT_EQ(positions, motion.positions[3]);
  EXPECT_EQ(velocities.norm(), 0);
}

TEST(Objective, HiddenClothCostsNothingAndAShiftOfAPlaneIsItsScore) {
  const data::TriangleMesh mesh = flat_sheet(10);
  const Motion motion{0, 0.1, {mesh.vertices}};
  Observation observation{.t = 0, .points = mesh.vertices.topRows(40)};  // a third of the sheet only
  observation.points.rowwise() += Eigen::RowVector3d(0, 0, 0.004);
  const auto scores = keyframe_scores(mesh.triangles, motion, {observation, {.t = 0.1}}, {}, {});
  EXPECT_NEAR(scores[0], 0.004, 1e-15);
  EXPECT_EQ(scores[1], 0);
  EXPECT_NEAR(weighted_mean_score(scores, {observation, {.t = 0.1}}), 0.004,
              1e-15);  // empty ones do not count
  EXPECT_EQ(weighted_mean_score({0.0}, {Observation{}}), std::numeric_limits<double>::infinity());

  EXPECT_GT(keyframe_coverage(motion, observation, {}, {}, {}), 0.05);
  // Cropped to what was seen, the other side is covered too.
  EXPECT_NEAR(keyframe_coverage(motion, observation, {}, {}, {.max = Eigen::Vector3d(1, 0.0801, 1)}), 0.004,
              1e-12);
}

TEST(Objective, RegistrationTurnsAboutItsPivotThenShifts) {
  const Registration registration{.offset = {0.1, 0, 0}, .yaw = std::acos(0.0), .pivot = {1, 1, 0}};
  const Eigen::Vector3d moved = registration.observed_from_simulated() * Eigen::Vector3d(2, 1, 5);
  EXPECT_NEAR((moved - Eigen::Vector3d(1.1, 2, 5)).norm(), 0, 1e-15);
}

}  // namespace
}  // namespace flash::sysid
