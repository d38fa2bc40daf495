#include "calib/calibrate/cell_motion.h"

#include <gtest/gtest.h>

#include "tests/calib/cell_scene.h"

namespace flash::calib {
namespace {

CellRecording recording_of(const HandEyeScene& scene, const std::string& camera) {
  SolvedMember solved = solved_member(scene, camera);
  CellRecording recording;
  recording.calibration = std::move(solved.calibration);
  recording.member = std::move(solved.member);
  for (std::size_t i = 0; i < scene.observations.size(); ++i) {
    recording.T_base_gripper.push_back(scene.observations[i].T_base_gripper);
    recording.stamps.push_back(static_cast<double>(i));
  }
  recording.solve = [scene, camera](const std::vector<Eigen::Isometry3d>& poses) {
    HandEyeScene other = scene;
    for (std::size_t i = 0; i < poses.size(); ++i) other.observations[i].T_base_gripper = poses[i];
    return solved_member(other, camera).calibration;
  };
  return recording;
}

bool tells_motion(const CellRecording& recording) {
  return recording.calibration.other_part || recording.calibration.drift;
}

std::vector<HandEyeScene> seen_scenes(unsigned seed) {
  std::vector<HandEyeScene> scenes = cell_scene(3, 24, seed);
  std::mt19937 random(seed);
  for (HandEyeScene& scene : scenes)
    for (std::size_t i = 0; i < scene.observations.size(); ++i) look(scene, i, scene.truth.X, random);
  return scenes;
}

TEST(CellMotion, OneThatOthersDidNotSeeWasTheRobotsError) {
  const std::vector<HandEyeScene> scenes = seen_scenes(4301);
  std::vector<CellRecording> recordings;
  for (const HandEyeScene& scene : scenes) recordings.push_back(recording_of(scene, "camera"));
  ASSERT_FALSE(tells_motion(recordings[0]) || tells_motion(recordings[1]) || tells_motion(recordings[2]));
  // Nothing moved; the first takes half of its views for those after a knock.
  recordings[0].calibration.other_part = KnockedPart{};
  recordings[0].member.observations.resize(12);
  recordings[0].member.stamps.resize(12);
  double reported = 0, corrected = 0;
  const auto solve = recordings[0].solve;
  recordings[0].solve = [&](const std::vector<Eigen::Isometry3d>& poses) {
    for (std::size_t i = 0; i < poses.size(); ++i) {
      reported +=
          motion_between(recordings[0].T_base_gripper[i], scenes[0].true_poses[i]).head<3>().squaredNorm();
      corrected += motion_between(poses[i], scenes[0].true_poses[i]).head<3>().squaredNorm();
    }
    return solve(poses);
  };
  const std::vector<std::string> sentences = settle_motions(recordings);
  ASSERT_EQ(sentences.size(), 1U);
  EXPECT_LT(corrected, reported);  // two cameras know better where the arm was than it does
  EXPECT_FALSE(tells_motion(recordings[0]));
  EXPECT_GE(recordings[0].member.observations.size(), 23U);
  for (std::size_t i = 0; i < recordings[0].member.observations.size(); ++i) {
    const auto view = static_cast<std::size_t>(recordings[0].member.stamps[i]);
    EXPECT_TRUE(recordings[0].member.observations[i].T_base_gripper.isApprox(
        scenes[0].observations[view].T_base_gripper, 0));
  }
}

TEST(CellMotion, OfACameraThatMovedStays) {
  std::vector<HandEyeScene> scenes = seen_scenes(4302);
  std::mt19937 random(4302);
  for (std::size_t i = 0; i < 10; ++i)
    look(scenes[0], i, scenes[0].truth.X * make_pose({0.005, -0.006, 0.004}, {0.006, 0.004, -0.005}), random);
  std::vector<CellRecording> recordings;
  for (const HandEyeScene& scene : scenes) recordings.push_back(recording_of(scene, "camera"));
  ASSERT_TRUE(tells_motion(recordings[0]));
  EXPECT_TRUE(settle_motions(recordings).empty());
  EXPECT_TRUE(tells_motion(recordings[0]));
}

// A target that moved is seen by all: none is a witness against the others.
TEST(CellMotion, OfATargetThatMovedStays) {
  std::vector<HandEyeScene> scenes = seen_scenes(4303);
  std::mt19937 random(4303);
  for (HandEyeScene& scene : scenes) {
    const Eigen::Isometry3d Z = scene.truth.Z;
    scene.truth.Z = Z * make_pose({0.006, -0.006, 0.005}, {0.02, 0.01, -0.02});
    for (std::size_t i = 0; i < 10; ++i) look(scene, i, scene.truth.X, random);
    scene.truth.Z = Z;
  }
  std::vector<CellRecording> recordings;
  for (const HandEyeScene& scene : scenes) recordings.push_back(recording_of(scene, "camera"));
  for (const CellRecording& recording : recordings) ASSERT_TRUE(tells_motion(recording));
  EXPECT_TRUE(settle_motions(recordings).empty());
}

}  // namespace
}  // namespace flash::calib
