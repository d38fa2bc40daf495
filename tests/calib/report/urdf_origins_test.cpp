#include "calib/report/urdf_origins.h"

#include <gtest/gtest.h>

#include "calib/dataset/urdf_file.h"
#include "calib/geometry/pose.h"
#include "data/files/atomic_file.h"
#include "tests/data/temporary_folder.h"

namespace flash::calib {
namespace {

/// Joints with an origin, with half of one, with none; names that stand elsewhere too.
constexpr const char* kArm = R"(<?xml version="1.0"?>
<!-- <joint name="elbow"><origin xyz="9 9 9"/></joint> -->
<robot name='arm'>
  <link name="base"><visual><origin xyz="7 7 7"/></visual></link>
  <link name="upper"/> <link name="fore"/> <link name="hand"/> <link name="tool"/>
  <transmission name="t"><joint name="elbow"><hardwareInterface>x</hardwareInterface></joint></transmission>
  <joint type="revolute" name="shoulder"><parent link="base"/><child link="upper"/>
    <origin  rpy = '0.1 0 0'  xyz="0 0 0.3" /> <axis xyz="0 0 1"/></joint>
  <joint name="elbow" type="continuous"><!-- <origin xyz="8 8 8"/> -->
    <parent link="upper"/><child link="fore"/><origin xyz="0.5 0 0"></origin><axis xyz="0 1 0"/></joint>
  <joint name="wrist" type="revolute"><parent link="fore"/><child link="hand"/><axis xyz="1 0 0"/></joint>
  <joint name="flange" type="fixed"><parent link="hand"/><child link="tool"/><origin xyz="0.1 0 0" rpy="0 1.5708 0"/></joint>
</robot>
)";

class UrdfOrigins : public testing::Test {
 protected:
  UrdfOrigins() {
    arm_.chain = load_urdf(folder_.write("arm.urdf", kArm));
    arm_.lengths = link_lengths(arm_.chain);
    errors_ = 1e-3 * Eigen::VectorXd::LinSpaced(12, -1, 1.5);
    origins_ = joint_origins(arm_, errors_);
  }
  data::TemporaryFolder folder_;
  ArmModel arm_;
  Eigen::VectorXd errors_;
  std::vector<JointOrigin> origins_;
};

TEST_F(UrdfOrigins, AreThoseOfTheCorrectedChain) {
  ASSERT_EQ(origins_.size(), 4U);
  const std::string text = with_joint_origins(kArm, "arm.urdf", origins_);
  const SerialChain read = load_urdf(folder_.write("corrected.urdf", text));
  const Eigen::Vector3d q(0.4, -0.7, 1.1);
  const Vector6d apart =
      motion_between(gripper_pose(corrected_chain(arm_, errors_), q), gripper_pose(read, q));
  EXPECT_LT(apart.cwiseAbs().maxCoeff(), 1e-8);  // nine digits of each of four origins
  EXPECT_EQ(with_joint_origins(text, "arm.urdf", origins_), text);
}

TEST_F(UrdfOrigins, NothingElseChanges) {
  const std::string text = with_joint_origins(kArm, "arm.urdf", origins_);
  std::string was = kArm, is = text;
  const auto take = [](std::string& from, const std::string& begin, const std::string& end) {
    const std::size_t a = from.find(begin), b = from.find(end, a);
    ASSERT_NE(a, std::string::npos) << from;
    from.erase(a, b + end.size() - a);
  };
  take(is, "<origin  rpy = '", "/>");
  take(was, "<origin  rpy = '", "/>");
  take(is, "<origin xyz=\"0.5", ">");
  take(was, "<origin xyz=\"0.5", ">");
  take(is, "<origin xyz=\"0.1", ">");
  take(was, "<origin xyz=\"0.1", ">");
  const std::string wrist = "<joint name=\"wrist\" type=\"revolute\">";
  EXPECT_NE(is.find(wrist + "<origin"), std::string::npos) << is;
  take(is, wrist, "/>");
  take(was, wrist, ">");
  EXPECT_EQ(is, was);
}

TEST_F(UrdfOrigins, AreTheJointsOwnWhereOtherElementsHaveSomeToo) {
  const std::string own = "<origin xyz=\"0.5 0 0\">",
                    other = "<safety><origin xyz=\"4 4 4\"/></safety><origin_of xyz=\"5 5 5\"/>";
  std::string arm = kArm;
  arm.insert(arm.find(own), other);
  const std::string text = with_joint_origins(arm, "arm.urdf", origins_);
  EXPECT_NE(text.find(other), std::string::npos) << text;
  EXPECT_EQ(text.find(own), std::string::npos) << text;
}

TEST_F(UrdfOrigins, FixedJointsOfAnotherRobotAreRefused) {
  arm_.lengths.clear();
  origins_ = joint_origins(arm_, errors_.head<3>());
  std::string other = kArm;
  other.replace(other.find("0.1 0 0\" rpy"), 7, "0.2 0 0");
  EXPECT_NE(data::input_error_of([&] {
              with_joint_origins(other, "arm.urdf", origins_);
            }).find("joint flange: found origin 0.2 0 0"),
            std::string::npos);
}

TEST_F(UrdfOrigins, OfAnotherRobotAreRefused) {
  const auto refusal = [&](std::string text, const std::string& from, const std::string& to) {
    text.replace(text.find(from), from.size(), to);
    return data::input_error_of([&] { with_joint_origins(text, "arm.urdf", origins_); });
  };
  EXPECT_NE(refusal(kArm, "name=\"wrist\"", "name=\"hand\"").find("joint wrist: found it 0 times"),
            std::string::npos);
  EXPECT_NE(refusal(kArm, "name=\"flange\"", "name=\"wrist\"").find("joint wrist: found it 2 times"),
            std::string::npos);
  EXPECT_NE(refusal(kArm, "0 0 0.3", "0 0 0.4").find("joint shoulder: found origin 0 0 0.4"),
            std::string::npos);
  // What moves the chain without a change of an origin that errors are in.
  const auto expect_refusal = [&](const char* from, const char* to, const char* words) {
    EXPECT_NE(refusal(kArm, from, to).find(words), std::string::npos) << refusal(kArm, from, to);
  };
  expect_refusal("type=\"continuous\"", "type=\"prismatic\"",
                 "joint elbow: found a prismatic joint, expected a revolute one");
  expect_refusal("<axis xyz=\"0 1 0\"/>", "<axis xyz=\"0 0 1\"/>",
                 "joint elbow: found axis 0 0 1, expected 0 1 0");
  expect_refusal("<parent link=\"fore\"/>", "<parent link=\"upper\"/>",
                 "joint wrist: found parent upper, expected fore");
  EXPECT_NE(refusal(kArm, "0 0 0.3", "0 0 ${h}").find("expected numbers"), std::string::npos);
  EXPECT_NE(refusal(kArm, "</robot>", "").find("is no XML"), std::string::npos);
  EXPECT_NE(refusal(kArm, "</robot>", "</robot><robot/>").find("behind the end"), std::string::npos);
  expect_refusal("<parent link=\"base\"/>", "<parent link=\"tool\"/>",
                 "carries link tool, on which it hangs itself");
}

}  // namespace
}  // namespace flash::calib
