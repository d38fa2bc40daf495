#include "sysid/capture/import_checks.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "data/mesh/procedural_mesh.h"
#include "sysid/capture/import_picture.h"
#include "tests/data/temporary_folder.h"

namespace flash::sysid {
namespace {

constexpr double kSide = 0.3;

/// A sheet that lies on a table at 0.1 m, its corner at the origin of the gripper, whose diagonal points
/// along +x, and is lifted at that corner by `height` within a second.
data::Recording lift_of(double height) {
  data::Recording recording;
  recording.mesh = data::parse_mesh_spec("sheet:0.3x0.3:0.05");
  recording.base_from_object.linear() =
      Eigen::AngleAxisd(-M_PI / 4, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  recording.base_from_object.translation() = Eigen::Vector3d(0, 0, 0.1);
  recording.has_table = true;
  recording.table_point.z() = 0.1;
  data::RecordedGrasp grasp;
  grasp.gripper = "gripper";
  grasp.select.corner = {0, 0};
  recording.grasps = {grasp};
  data::Trajectory& trajectory = recording.trajectories["gripper"];
  trajectory.times = {0, 1};
  trajectory.poses = {Eigen::Isometry3d(Eigen::Translation3d(0, 0, 0.1)),
                      Eigen::Isometry3d(Eigen::Translation3d(0, 0, 0.1 + height))};
  return recording;
}

/// What is seen above the table of a strip of `length` from the gripper on, which leans by a third.
std::vector<data::Keyframe> clouds_of(double length, double height) {
  std::vector<data::Keyframe> keyframes;
  for (const double t : {0.25, 0.5, 0.75, 1.0}) {
    data::Keyframe keyframe;
    keyframe.time = t;
    const Eigen::Vector3d tool(0, 0, 0.1 + t * height), along = Eigen::Vector3d(1, 0, -3).normalized();
    std::vector<Eigen::Vector3d> points;
    for (double s = 0; s <= length; s += 0.002)
      if (const Eigen::Vector3d point = tool + s * along; point.z() > 0.105) points.push_back(point);
    keyframe.cloud.resize(static_cast<Eigen::Index>(points.size()), 3);
    for (std::size_t i = 0; i < points.size(); ++i)
      keyframe.cloud.row(static_cast<Eigen::Index>(i)) = points[i].transpose();
    keyframes.push_back(keyframe);
  }
  return keyframes;
}

std::string said_of(const data::Recording& recording, const std::vector<data::Keyframe>& keyframes) {
  const std::vector<std::string> found = contradictions(recording, keyframes);
  std::string all;
  for (const std::string& text : found) all += text + "\n";
  return all;
}

const double diagonal = std::sqrt(2.0) * kSide;

TEST(ImportChecks, InputsThatBelongTogetherHaveNoContradiction) {
  for (const double height : {0.15, 0.8})  // part of it on the table still, and off it
    EXPECT_EQ(said_of(lift_of(height), clouds_of(diagonal, height)), "") << height;
  // A fold, whose far corner is not seen.
  EXPECT_EQ(said_of(lift_of(0.8), clouds_of(0.65 * diagonal, 0.8)), "");
}

TEST(ImportChecks, AGripperOfAnotherFrameIsNamed) {
  data::Recording recording = lift_of(0.8);
  for (Eigen::Isometry3d& pose : recording.trajectories["gripper"].poses) pose.translation().y() += 0.3;
  EXPECT_NE(said_of(recording, clouds_of(diagonal, 0.8)).find("the gripper is 0.3 m from the nearest point"),
            std::string::npos);
}

TEST(ImportChecks, ASheetOfAnotherSizeIsNamed) {
  EXPECT_NE(
      said_of(lift_of(0.8), clouds_of(2 * diagonal, 0.8)).find("a sheet of 0.3 m x 0.3 m at most 0.424 m"),
      std::string::npos);
  EXPECT_NE(said_of(lift_of(0.8), clouds_of(0.5 * diagonal, 0.8)).find("is it smaller than --mesh says"),
            std::string::npos);
}

TEST(ImportChecks, AGripperThatStandsStillWhileTheClothRisesIsNamed) {
  data::Recording recording = lift_of(0.15);
  for (Eigen::Isometry3d& pose : recording.trajectories["gripper"].poses) pose.translation().z() = 0.1;
  EXPECT_TRUE(
      said_of(recording, clouds_of(diagonal, 0.15)).starts_with("the gripper stands still while the cloth"));
}

// Frames that show a later time than they are given: lost ones before them, numbered anew.
TEST(ImportChecks, ClothAboveEveryPlaceOfTheGripperIsNamed) {
  const auto shifted = [](double by) {
    std::vector<data::Keyframe> keyframes = clouds_of(diagonal, 0.8);
    for (data::Keyframe& keyframe : keyframes) keyframe.time = std::max(0.0, keyframe.time - by);
    return said_of(lift_of(0.8), keyframes);
  };
  EXPECT_EQ(shifted(0.06), "");  // 48 mm at 0.8 m/s
  EXPECT_NE(shifted(0.2).find("the cloth is up to 0.1"), std::string::npos) << shifted(0.2);
  EXPECT_NE(shifted(0.2).find("in 4 frames: do the times of the frames and the trajectory belong together"),
            std::string::npos)
      << shifted(0.2);
  // What is lowered after the lift may fold over the gripper.
  data::Recording recording = lift_of(0.8);
  data::Trajectory& trajectory = recording.trajectories["gripper"];
  std::vector<data::Keyframe> keyframes = clouds_of(diagonal, 0.8);
  trajectory.times = {0, 1, 2};
  trajectory.poses.push_back(Eigen::Isometry3d(Eigen::Translation3d(0, 0, 0.1)));
  for (const double t : {1.7, 1.8, 1.9}) {
    keyframes.push_back(keyframes[1]);
    keyframes.back().time = t;
  }
  EXPECT_EQ(said_of(recording, keyframes).find("above the highest place"), std::string::npos)
      << said_of(recording, keyframes);
}

TEST(ImportChecks, AFlangeForTheToolIsNamed) {
  data::Recording recording = lift_of(0.15);
  for (Eigen::Isometry3d& pose : recording.trajectories["gripper"].poses) pose.translation().z() += 0.1;
  EXPECT_NE(said_of(recording, clouds_of(diagonal, 0.15)).find("the gripper starts 0.1 m above the table"),
            std::string::npos);
}

TEST(ImportChecks, AHalfTurnOfTheSheetIsNamed) {
  data::Recording recording = lift_of(0.8);
  recording.base_from_object.linear() = Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitZ()).toRotationMatrix() *
                                        recording.base_from_object.linear();
  EXPECT_NE(said_of(recording, clouds_of(diagonal, 0.8)).find("is it turned by half a turn?"),
            std::string::npos);
}

TEST(ImportChecks, ThePictureShowsWhatASearchStartsFrom) {
  const std::string svg = draw_import(lift_of(0.8), clouds_of(diagonal, 0.8), {{0.5, -1, 0.9}});
  for (const char* words :
       {"sheet as it starts", "way of the gripper", "table", "camera 0.50 -1.00 0.90 m",
        "cloud 0.00 s after the first", "cloud 0.75 s after the first", "100 mm", "</svg>"})
    EXPECT_NE(svg.find(words), std::string::npos) << words;
}

TEST(ImportChecks, AnApproachIsNamedWithItsEnd) {
  data::Recording recording = lift_of(0.8);
  data::Trajectory& trajectory = recording.trajectories["gripper"];
  EXPECT_EQ(approach_of(trajectory), "");
  trajectory.times = {10, 10.5, 11, 12, 13};
  trajectory.poses.clear();
  for (const double z : {0.17, 0.1, 0.1, 0.5, 0.05})
    trajectory.poses.emplace_back(Eigen::Translation3d(0, 0, z));
  EXPECT_EQ(approach_of(trajectory),
            "the gripper comes down by 0.07 m first, until 10.5 s: --from 10.5 starts there");
}

TEST(ImportChecks, APatchOfMoreThanHalfOfTheSheetIsRefused) {
  data::Recording recording = lift_of(0.8);
  recording.grasps[0].select.within = 0.15;
  EXPECT_EQ(data::input_error_of([&] { check_patch(recording); }), "");
  recording.grasps[0].select.within = 25;
  EXPECT_EQ(data::input_error_of([&] { check_patch(recording); }),
            "--grasp-within: found 25 m, expected at most half of the sheet's longer side, 0.15 m (25 mm are "
            "0.025)");
}

TEST(ImportChecks, BoundsOfOtherUnitsAreQuestionedInOneLine) {
  data::Recording recording = lift_of(0.8);
  recording.grasps[0].select.within = 0.025;
  recording.nuisance.offset.setConstant(0.06);  // a camera placed by hand
  recording.nuisance.yaw = 0.26;
  EXPECT_EQ(questioned_settings(recording), "");
  recording.nuisance.offset.setConstant(10);
  recording.nuisance.yaw = 2;
  EXPECT_EQ(
      questioned_settings(recording),
      "import: unusual, is the unit right? --offset-bound found 10 m, usually 0 to 0.1 (10 mm are 0.01); "
      "--yaw-bound found 2 rad, usually 0 to 0.35 (2 deg are 0.035)");
}

}  // namespace
}  // namespace flash::sysid
