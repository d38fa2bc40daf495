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

data::Keyframe seen_at(double t, const std::vector<Eigen::Vector3d>& points) {
  data::Keyframe keyframe;
  keyframe.time = t;
  keyframe.cloud.resize(static_cast<Eigen::Index>(points.size()), 3);
  for (std::size_t i = 0; i < points.size(); ++i)
    keyframe.cloud.row(static_cast<Eigen::Index>(i)) = points[i].transpose();
  return keyframe;
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
    keyframes.push_back(seen_at(t, points));
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
  data::Recording recording = lift_of("sheet:0.27x0.42:0.03");
  EXPECT_NE(compare_sides(recording, raised_clouds(), *stated_sheet(recording, kHeading))
                .at(0)
                .find("change the sides over"),
            std::string::npos);
  // A camera that may be so far off explains it.
  EXPECT_EQ(said_of("sheet:0.27x0.42:0.03", kHeading, 0.06), "");
}

/// The same cloth in true length: a plane from the corner in the fingers down to a fold at 1.5 times its
/// height.
std::vector<data::Keyframe> bent_clouds() {
  const Eigen::Rotation2Dd turn(kHeading - std::atan2(kLeft, kRight));
  const Eigen::Vector2d bisector = Eigen::Vector2d(1, 1).normalized();
  std::vector<data::Keyframe> keyframes;
  for (const double t : {0.4, 0.6, 0.8, 1.0}) {
    const double height = 0.12 * t, length = 1.5 * height, flat = std::sqrt(1.25) * height;
    std::vector<Eigen::Vector3d> points;
    for (double u = 0; u <= kRight; u += 0.004)
      for (double v = 0; v <= kLeft; v += 0.004) {
        const double along = bisector.dot(Eigen::Vector2d(u, v));
        if (along > 0.95 * length) continue;
        const Eigen::Vector2d at = turn * (Eigen::Vector2d(u, v) + along * (flat / length - 1) * bisector);
        points.emplace_back(0.45 + at.x(), -0.3 + at.y(), 0.012 + height * (1 - along / length));
      }
    keyframes.push_back(seen_at(t, points));
  }
  return keyframes;
}

/// What is said of sides where the heading is known to 6 degrees and `off` wrong.
std::string swapped_of(const std::string& mesh, double off = 0, double bound = 0) {
  data::Recording recording = lift_of(mesh);
  recording.nuisance.offset.setConstant(bound);
  return swapped_sides(recording, bent_clouds(), *stated_sheet(recording, kHeading + off * kDegree),
                       6 * kDegree);
}

TEST(LyingChecks, RaisedClothTellsSwappedSidesWithTheirRemedy) {
  const std::string said = swapped_of("sheet:0.27x0.42:0.03:alternating");
  EXPECT_TRUE(
      said.starts_with("the cloth lies with 420 mm on the right hand of its diagonal and 270 mm on the "
                       "left, and --mesh says 270 mm and 420 mm"))
      << said;
  EXPECT_NE(said.find("swap the sides, --mesh sheet:0.42x0.27:0.03:alternating, or name another corner"),
            std::string::npos)
      << said;
  // A heading that is as far off as the two diagonals are apart would do the same.
  EXPECT_NE(said.find("or is it --heading -"), std::string::npos) << said;
  EXPECT_EQ(swapped_of("sheet:0.27x0.42:0.03", 0, 0.06), "");  // a camera that may be so far off explains it
}

TEST(LyingChecks, SidesThatAreNotSwappedAreTaken) {
  for (const char* mesh : {"sheet:0.42x0.27:0.03", "sheet:0.37x0.24:0.03", "sheet:0.47x0.3:0.03",
                           "sheet:0.36x0.36:0.03", "sheet:0.36x0.32:0.03", "sheet:0.32x0.36:0.03"})
    for (const double off : {-6.0, 0.0, 6.0}) EXPECT_EQ(swapped_of(mesh, off), "") << mesh << ' ' << off;
}

TEST(LyingChecks, WhichSideIsTakenForWhichIsSaid) {
  const data::Recording recording = lift_of("sheet:0.42x0.27:0.03");
  EXPECT_EQ(
      sides_taken(*stated_sheet(recording, kHeading)),
      "import: --mesh: the side on the right hand is 420 mm and that on the left 270 mm, from the grasped "
      "corner along the diagonal and seen from above");
}

}  // namespace
}  // namespace flash::sysid
