#include "calib/calibrate/cell_misfits.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>

#include "tests/calib/cell_scene.h"

namespace flash::calib {
namespace {

constexpr double kChiSquare99 = 16.812;  // six degrees of freedom

bool says(const std::vector<std::string>& sentences, const std::string& start) {
  return std::any_of(sentences.begin(), sentences.end(),
                     [&](const std::string& sentence) { return sentence.starts_with(start); });
}

/// Four cameras, two rows of the robot that are wrong by 13 degrees, six pictures of the second camera that
/// belong to others of its poses, and a last camera that sags after its first five views.
bool faults_are_named(unsigned seed) {
  constexpr std::size_t kViews = 24;
  constexpr std::size_t kRows[] = {9, 16}, kPictures[] = {1, 6, 8, 12, 14, 20};
  std::vector<HandEyeScene> scenes = cell_scene(4, kViews, seed);
  std::mt19937 random(seed);
  for (HandEyeScene& scene : scenes) {
    const bool sags = &scene == &scenes.back();
    for (std::size_t i = 0; i < kViews; ++i) {
      const Eigen::Isometry3d before =
          scene.truth.X * make_pose({0.004, -0.006, 0.003}, {0.006, 0.004, -0.005});
      look(scene, i, sags && i < 5 ? before : scene.truth.X, random);
    }
    for (const std::size_t row : kRows) {
      Eigen::Isometry3d& pose = scene.observations[row].T_base_gripper;
      pose = moved(pose, (Vector6d() << 0, 0, 0, 0, 13 * M_PI / 180, 0).finished());
    }
  }
  std::vector<Observation>& second = scenes[1].observations;
  const Observation first = second[kPictures[0]];
  for (std::size_t k = 0; k < std::size(kPictures); ++k) {
    const Observation& next = k + 1 < std::size(kPictures) ? second[kPictures[k + 1]] : first;
    second[kPictures[k]].pixels = next.pixels;
    second[kPictures[k]].T_camera_target = next.T_camera_target;
  }
  std::vector<CellMember> members;
  std::vector<std::vector<std::string>> warnings;
  for (std::size_t c = 0; c < scenes.size(); ++c) {
    SolvedMember solved = solved_member(scenes[c], "camera" + std::to_string(c));
    warnings.push_back(solved.calibration.warnings);
    members.push_back(std::move(solved.member));
  }
  const Cell cell = solve_cell(members);
  bool right = says(cell.notices, "base: the robot's poses at 9, 16 do not fit") &&
               says(cell.notices, "camera1: 1, 6, 8, 12, 14, 20: left out") &&
               misfit_sentences(members).size() == 2;
  for (std::size_t c = 0; c < scenes.size(); ++c) {
    const bool sags = c + 1 == scenes.size();
    const bool moved =
        says(warnings[c], "the camera moved by") || says(warnings[c], "the camera or the target moved by");
    right = right && moved == sags;
    // The view next to a motion may be told to be of either side.
    if (sags)
      right = right && (warnings[c].front().find(" before 5:") != std::string::npos ||
                        warnings[c].front().find(" before 4:") != std::string::npos);
    const Vector6d error = motion_between(cell.cameras[c].transform.T, scenes[c].truth.X);
    right = right && error.dot(cell.cameras[c].covariance.ldlt().solve(error)) < kChiSquare99;
  }
  return right;
}

TEST(CellMisfits, AreNamedByWhoseFaultTheyAre) {
  constexpr unsigned kSeeds = 4;
  unsigned right = 0;
  for (unsigned seed = 0; seed < kSeeds; ++seed) right += faults_are_named(4100 + seed);
  EXPECT_GE(right, kSeeds - 1);  // nine of ten: of four two wrong once in twenty
}

MisfitView misfit(int view) {
  return {std::to_string(view), static_cast<double>(view), Eigen::Isometry3d::Identity()};
}

CellMember with_views(const std::string& camera, const std::vector<int>& used,
                      const std::vector<int>& left_out) {
  CellMember member;
  member.arm = "base";
  member.camera = camera;
  for (const int view : used) {
    member.observations.emplace_back();
    member.observations.back().T_base_gripper.setIdentity();
    member.stamps.push_back(view);
  }
  for (const int view : left_out) member.misfits.push_back(misfit(view));
  return member;
}

TEST(CellMisfits, AreTheRobotsWhereMostCamerasLeaveThemOut) {
  const std::vector<CellMember> members = {with_views("a", {1, 2}, {3, 5}), with_views("b", {1}, {2, 3}),
                                           with_views("c", {1, 2, 3}, {})};
  const std::vector<std::string> sentences = misfit_sentences(members);
  ASSERT_EQ(sentences.size(), 3U);
  EXPECT_TRUE(sentences[0].starts_with("base: the robot's poses at 3 ")) << sentences[0];
  EXPECT_TRUE(sentences[1].starts_with("b: 2: left out, as other cameras fit")) << sentences[1];
  EXPECT_TRUE(sentences[2].starts_with("a: 5 of base: left out, and no other camera")) << sentences[2];
  EXPECT_EQ(without_wrong_poses(members)[2].stamps, (std::vector<double>{1, 2}));
  EXPECT_EQ(without_wrong_poses(members)[0].stamps, (std::vector<double>{1, 2}));
}

}  // namespace
}  // namespace flash::calib
