#include "sysid/capture/lying_checks.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "data/mesh/procedural_mesh.h"

namespace flash::sysid {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kRight = 0.42, kLeft = 0.27, kHeading = -112 * kDegree;

/// Lifted at its corner 0,0, straight up by 0.12 m in a second.
data::Recording lift_of(const std::string& mesh) {
  data::Recording recording;
  recording.mesh_spec = mesh;
  recording.mesh = data::parse_mesh_spec(mesh);
  recording.base_from_object.translation() = Eigen::Vector3d(0.45, -0.3, 0.012);
  data::RecordedGrasp grasp;
  grasp.gripper = "gripper";
  grasp.select.corner = {0, 0};
  recording.grasps = {grasp};
  data::Trajectory& trajectory = recording.trajectories["gripper"];
  trajectory.times = {0, 1};
  trajectory.poses = {Eigen::Isometry3d(Eigen::Translation3d(0.45, -0.3, 0.012)),
                      Eigen::Isometry3d(Eigen::Translation3d(0.45, -0.3, 0.132))};
  return recording;
}

/// What is seen of the sheet kRight x kLeft whose diagonal points along kHeading: a fold across the bisector
/// of its corner parts what is raised from what lies; a corner raised by h has about 2 h of raised cloth,
/// whose points come inwards.
std::vector<data::Keyframe> raised_clouds() {
  const Eigen::Rotation2Dd turn(kHeading - std::atan2(kLeft, kRight));
  std::vector<data::Keyframe> keyframes;
  for (const double t : {0.25, 0.5, 0.75, 1.0}) {
    std::vector<Eigen::Vector3d> points;
    const double reach = 2 * 0.12 * t;
    for (double u = 0; u <= reach; u += 0.004)
      for (double v = 0; u + v <= reach && v <= kLeft; v += 0.004) {
        const Eigen::Vector2d at = Eigen::Vector2d(0.45, -0.3) + turn * Eigen::Vector2d(u, v);
        points.emplace_back(at.x(), at.y(), 0.022 + 0.5 * (reach - u - v));
      }
    data::Keyframe keyframe;
    keyframe.time = t;
    keyframe.cloud.resize(static_cast<Eigen::Index>(points.size()), 3);
    for (std::size_t i = 0; i < points.size(); ++i)
      keyframe.cloud.row(static_cast<Eigen::Index>(i)) = points[i].transpose();
    keyframes.push_back(keyframe);
  }
  return keyframes;
}

std::string said_of(const std::string& mesh, double heading, double bound = 0) {
  data::Recording recording = lift_of(mesh);
  recording.nuisance.offset.setConstant(bound);
  return beside_the_sheet(recording, raised_clouds(), *stated_sheet(recording, heading));
}

TEST(LyingChecks, ARaisedCornerLiesWhereTheSheetLay) {
  EXPECT_EQ(said_of("sheet:0.42x0.27:0.03", kHeading), "");
  for (const double off : {-6.0, 6.0})  // what a heading is known to by eye
    EXPECT_EQ(said_of("sheet:0.42x0.27:0.03", kHeading + off * kDegree), "") << off;
}

TEST(LyingChecks, AnotherHeadingIsToldWithThoseThatFit) {
  for (const double off : {110.0, -110.0, 180.0, 90.0, 60.0}) {
    const std::string said = said_of("sheet:0.42x0.27:0.03", kHeading + off * kDegree);
    EXPECT_NE(said.find("beyond the place where the sheet lies"), std::string::npos) << off;
    EXPECT_NE(said.find("--heading -1"), std::string::npos) << off << said;
    EXPECT_EQ(said.find("sides changed over"), std::string::npos) << off << said;
  }
  EXPECT_NE(said_of("sheet:0.42x0.27:0.03", -1.95 * kDegree), "");  // radians
}

TEST(LyingChecks, ChangedSidesAreTold) {
  const std::string said = said_of("sheet:0.27x0.42:0.03", kHeading);
  EXPECT_NE(said.find("they fit with the sides changed over"), std::string::npos) << said;
  // Where bounds explain how far they reach, the changed sides still explain it better.
  const auto compared = [](const std::string& mesh) {
    const data::Recording recording = lift_of(mesh);
    return compare_sides(recording, raised_clouds(), *stated_sheet(recording, kHeading));
  };
  EXPECT_TRUE(compared("sheet:0.42x0.27:0.03").empty());
  EXPECT_NE(compared("sheet:0.27x0.42:0.03").at(0).find("change the sides over"), std::string::npos);
  // A camera that may be so far off explains it.
  EXPECT_EQ(said_of("sheet:0.27x0.42:0.03", kHeading, 0.06), "");
}

}  // namespace
}  // namespace flash::sysid
