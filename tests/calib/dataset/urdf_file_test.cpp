#include "calib/dataset/urdf_file.h"

#include <gtest/gtest.h>

#include "calib/dataset/joint_list.h"
#include "calib/geometry/pose.h"
#include "calib/report/robot_file.h"
#include "data/files/error.h"
#include "tests/data/temporary_folder.h"

namespace flash::calib {
namespace {

/// Two joints that turn, one that slides, and a camera that hangs on the way.
constexpr const char* kArm = R"(<?xml version="1.0"?>
<robot name="arm">
  <link name="base"/> <link name="upper"/> <link name="fore"/> <link name="slide"/> <link name="tool"/> <link name="eye"/>
  <joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/>
    <origin xyz="0 0 0.3" rpy="0 0 0"/><axis xyz="0 0 1"/></joint>
  <joint name="elbow" type="continuous"><parent link="upper"/><child link="fore"/>
    <origin xyz="0.5 0 0"/><axis xyz="0 2 0"/></joint>
  <joint name="rail" type="prismatic"><parent link="fore"/><child link="slide"/>
    <origin xyz="0 0 0.1" rpy="0.1 0.2 0.3"/><axis xyz="1 0 0"/></joint>
  <joint name="flange" type="fixed"><parent link="slide"/><child link="tool"/><origin xyz="0 0 0.05"/></joint>
  <joint name="mount" type="fixed"><parent link="fore"/><child link="eye"/></joint>
</robot>)";

class Urdf : public testing::Test {
 protected:
  std::string write(const std::string& name, const std::string& text) const {
    return folder_.write(name, text);
  }
  data::TemporaryFolder folder_;
};

Eigen::Isometry3d shifted(double x, double y, double z) {
  return Eigen::Isometry3d(Eigen::Translation3d(x, y, z));
}

Eigen::Isometry3d turned(double angle, const Eigen::Vector3d& axis) {
  return Eigen::Isometry3d(Eigen::AngleAxisd(angle, axis));
}

TEST_F(Urdf, PoseOfTheGripperIsTheProductOfItsJoints) {
  const SerialChain chain = load_urdf(write("arm.urdf", kArm), "", "tool");
  EXPECT_EQ(moving_joints(chain), (std::vector<std::string>{"shoulder", "elbow", "rail"}));
  const Eigen::Vector3d q(0.4, -0.7, 0.12);
  const Eigen::Isometry3d rpy = turned(0.3, Eigen::Vector3d::UnitZ()) *
                                turned(0.2, Eigen::Vector3d::UnitY()) * turned(0.1, Eigen::Vector3d::UnitX());
  const Eigen::Isometry3d expected = shifted(0, 0, 0.3) * turned(0.4, Eigen::Vector3d::UnitZ()) *
                                     shifted(0.5, 0, 0) * turned(-0.7, Eigen::Vector3d::UnitY()) *
                                     shifted(0, 0, 0.1) * rpy * shifted(0.12, 0, 0.05);
  EXPECT_TRUE(gripper_pose(chain, q).isApprox(expected, 1e-14));
}

TEST_F(Urdf, MotionsOfTheJointsAreDerivatives) {
  const SerialChain chain = load_urdf(write("arm.urdf", kArm), "base", "tool");
  const Eigen::Vector3d q(0.4, -0.7, 0.12);
  const auto J = joint_motions(chain, q);
  for (Eigen::Index k = 0; k < 3; ++k) {
    constexpr double h = 1e-5;
    const Eigen::Vector3d step = h * Eigen::Vector3d::Unit(k);
    const Vector6d d = (motion_between(gripper_pose(chain, q), gripper_pose(chain, q + step)) -
                        motion_between(gripper_pose(chain, q), gripper_pose(chain, q - step))) /
                       (2 * h);
    EXPECT_LT((J.col(k) - d).norm(), 1e-9);  // h^2 of central differences
  }
}

TEST_F(Urdf, WhatIsNoChainIsNamed) {
  const std::string arm = write("arm.urdf", kArm);
  EXPECT_NE(data::input_error_of([&] { load_urdf(arm); }).find("eye, tool"), std::string::npos);
  EXPECT_NE(data::input_error_of([&] { load_urdf(arm, "base", "hand"); }).find("from link base to link hand"),
            std::string::npos);
  EXPECT_NE(data::input_error_of([&] { load_urdf(write("a.urdf", "<robot><joint")); }).find("expected XML"),
            std::string::npos);
  EXPECT_NE(data::input_error_of([&] { load_urdf(write("b.urdf", "<model/>")); }).find("no element robot"),
            std::string::npos);
}

TEST_F(Urdf, CamerasThatWereExportedIntoItAreNoEndsOfTheArm) {
  std::string arm = kArm;
  const std::string mount =
      R"(  <joint name="mount" type="fixed"><parent link="fore"/><child link="eye"/></joint>)";
  arm.erase(arm.find(mount), mount.size());
  const std::size_t links = load_urdf(write("arm.urdf", arm)).joints.size();
  for (const std::string carrier : {"tool", "base"})
    arm = camera_in_urdf(arm, "arm.urdf",
                         {.parent = carrier, .child = carrier + "_camera", .T = shifted(0, 0.1, 0)});
  const std::string path = write("seen.urdf", arm);
  EXPECT_EQ(load_urdf(path).joints.size(), links);
  EXPECT_EQ(load_urdf(path, "", "tool_camera").joints.size(), links + 1);
  const std::string begin = "<!-- flash-calib: tool_camera -->";
  arm.erase(arm.find(begin), begin.size());
  EXPECT_NE(data::input_error_of([&] { load_urdf(write("half.urdf", arm)); }).find("expected both"),
            std::string::npos);
}

TEST_F(Urdf, JointsBesideTheChainMayBeOfAnyKind) {
  std::string arm = kArm;
  arm.insert(arm.find("</robot>"),
             "<joint name=\"finger\" type=\"prismatic\"><parent link=\"tool\"/><child link=\"left\"/>"
             "<mimic joint=\"other\"/></joint>"
             "<joint name=\"cable\" type=\"floating\"><parent link=\"tool\"/><child link=\"plug\"/></joint>");
  const std::string path = write("fingers.urdf", arm);
  EXPECT_EQ(moving_joints(load_urdf(path, "base", "tool")).size(), 3U);
  EXPECT_NE(data::input_error_of([&] { load_urdf(path, "base", "left"); }).find("mimic"), std::string::npos);
  EXPECT_NE(data::input_error_of([&] { load_urdf(path, "base", "plug"); }).find("floating"),
            std::string::npos);
}

TEST_F(Urdf, JointsAreReadByNameOrNumber) {
  const SerialChain chain = load_urdf(write("arm.urdf", kArm), "base", "tool");
  const data::PoseList named = load_joint_list(
      write("joints.csv", "image,rail,elbow_deg,shoulder\n000.png,0.12,-30,0.4\n001.png,0,0,0\n"), chain);
  ASSERT_EQ(named.poses.size(), 2U);
  EXPECT_EQ(named.poses[0].image, "000.png");
  const Eigen::Vector3d q(0.4, -M_PI / 6, 0.12);
  EXPECT_TRUE(named.poses[0].joints.isApprox(q, 1e-12));
  EXPECT_TRUE(named.poses[0].pose.isApprox(gripper_pose(chain, q), 1e-12));
  const data::PoseList numbered = load_joint_list(write("q.csv", "index;q1;q2;q3\n7;0.4;-0.5;0.12\n"), chain);
  EXPECT_EQ(numbered.poses[0].stamp, 7);
  EXPECT_EQ(numbered.poses[0].joints, Eigen::Vector3d(0.4, -0.5, 0.12));
  EXPECT_NE(data::input_error_of([&] {
              load_joint_list(write("few.csv", "index,q1,q2\n0,1,2\n"), chain);
            }).find("no column of joint rail"),
            std::string::npos);
  EXPECT_NE(data::input_error_of([&] {
              load_joint_list(write("far.csv", "index,q1,q2,q3\n0,90,2,0\n"), chain);
            }).find("more than two turns"),
            std::string::npos);
}

}  // namespace
}  // namespace flash::calib
