#include "sysid/capture/import_checks.h"

#include <gtest/gtest.h>

#include "data/procedural_mesh.h"
#include "sysid/capture/import_picture.h"

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
  for (const char* words : {"sheet as it starts", "way of the gripper", "table", "camera 0.50 -1.00 0.90 m",
                            "cloud at 0.25 s", "cloud at 1.00 s", "100 mm", "</svg>"})
    EXPECT_NE(svg.find(words), std::string::npos) << words;
}

}  // namespace
}  // namespace flash::sysid
