#include "calib/report/robot_file.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/data/temporary_folder.h"

namespace flash::calib {
namespace {

const data::NamedTransform transform{"tool0", "eye", Eigen::Isometry3d::Identity()};

TEST(RobotFile, OfAUrdfTheCameraAloneChanges) {
  const std::string robot = "<robot name='r'>\n  <link name='tool0'/><!-- kept -->\n</robot>\n";
  const std::string once = camera_in_urdf(robot, "r.urdf", transform);
  EXPECT_EQ(once.substr(0, robot.find("\n</robot>")), robot.substr(0, robot.find("\n</robot>")));
  EXPECT_NE(once.find("<child link=\"eye\"/>"), std::string::npos);
  EXPECT_EQ(camera_in_urdf(once, "r.urdf", transform), once);
}

TEST(RobotFile, OfXacroALinkMayBeMadeByAMacro) {
  const std::string robot =
      "<robot xmlns:xacro='http://www.ros.org/wiki/xacro'>\n  <xacro:arm prefix='a_'/>\n</robot>\n";
  EXPECT_NE(camera_in_urdf(robot, "r.xacro", transform).find("<parent link=\"tool0\"/>"), std::string::npos);
}

TEST(RobotFile, OfMjcfTheBodyOfTheNameTakesTheCamera) {
  const std::string robot =
      "<mujoco><worldbody>\n  <!-- <body name=\"tool0\"> -->\n  <body name='a > b'/>\n"
      "  <body name='tool0' pos='0 0 1'>\n    <geom size='1'/>\n  </body>\n</worldbody></mujoco>\n";
  const std::string once = camera_in_mjcf(robot, "r.xml", transform);
  const std::size_t camera = once.find("<camera name=\"eye\"");
  ASSERT_NE(camera, std::string::npos) << once;
  EXPECT_GT(camera, once.find("<body name='tool0'"));
  EXPECT_LT(camera, once.find("<geom"));
  EXPECT_EQ(camera_in_mjcf(once, "r.xml", transform), once);
}

// Two cameras that carry each other are no tree.
TEST(RobotFile, LinesEndAsThoseOfTheRobot) {
  const std::string robot = "<robot>\r\n  <link name='tool0'/>\r\n</robot>\r\n";
  const std::string once = camera_in_urdf(robot, "r.urdf", transform);
  EXPECT_EQ(std::count(once.begin(), once.end(), '\r'), std::count(once.begin(), once.end(), '\n'));
  EXPECT_EQ(camera_in_urdf(once, "r.urdf", transform), once);
}

TEST(RobotFile, ACameraDoesNotCarryItself) {
  const std::string robot = "<robot><link name='tool0'/></robot>";
  data::NamedTransform eye = transform, other = transform;
  other.parent = "eye";
  other.child = "other";
  const std::string both = camera_in_urdf(camera_in_urdf(robot, "r.urdf", eye), "r.urdf", other);
  eye.parent = "other";
  EXPECT_NE(data::input_error_of([&] { camera_in_urdf(both, "r.urdf", eye); }).find("does not carry"),
            std::string::npos);
}

TEST(RobotFile, WhatHoldsNoCameraIsRefused) {
  const auto urdf = [](const std::string& text) {
    return data::input_error_of([&] { camera_in_urdf(text, "r.urdf", transform); });
  };
  const auto mjcf = [](const std::string& text) {
    return data::input_error_of([&] { camera_in_mjcf(text, "r.xml", transform); });
  };
  EXPECT_NE(urdf("").find("is no XML"), std::string::npos);
  EXPECT_NE(urdf("<robot>").find("is no XML"), std::string::npos);
  EXPECT_NE(urdf("<robot/>").find("expected \"tool0\""), std::string::npos);
  EXPECT_NE(urdf("<robot><link name='tool0'/><link name='eye'/></robot>").find("did not write"),
            std::string::npos);
  EXPECT_NE(urdf("<robot><link name='tool0'/><!-- flash-calib: eye --></robot>").find("expected both"),
            std::string::npos);
  EXPECT_NE(mjcf("<mujoco><worldbody/></mujoco>").find("expected \"tool0\""), std::string::npos);
  EXPECT_NE(mjcf("<mujoco><worldbody><body name='tool0'/></worldbody></mujoco>").find("an end of its own"),
            std::string::npos);
}

}  // namespace
}  // namespace flash::calib
