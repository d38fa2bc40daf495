#include "data/motion/pose_npz.h"

#include <gtest/gtest.h>

#include <cmath>

#include "data/files/error.h"
#include "tests/data/npz_text.h"
#include "tests/data/temporary_folder.h"

namespace flash::data {
namespace {

// Turns by 90 degrees about z and by 180 about x: their matrices are written out by hand.
constexpr double kFirst[] = {0, -1, 0, 0.1, 1, 0, 0, 0.2, 0, 0, 1, 0.3, 0, 0, 0, 1};
constexpr double kSecond[] = {1, 0, 0, 0.4, 0, -1, 0, 0.5, 0, 0, -1, 0.6, 0, 0, 0, 1};

/// Row by row, of both poses: those of the 4 x 4 matrix whose place passes.
template <class Passes>
std::vector<double> both(const Passes& passes) {
  std::vector<double> values;
  for (const double* pose : {kFirst, kSecond})
    for (int i = 0; i < 16; ++i)
      if (passes(i / 4, i % 4)) values.push_back(pose[i]);
  return values;
}

const std::vector<double> kMatrices = both([](int, int) { return true; });

void expect_both(const std::vector<PosePair>& pairs) {
  ASSERT_EQ(pairs.size(), 2U);
  for (const auto member : {&PosePair::T_base_gripper, &PosePair::T_camera_target}) {
    EXPECT_EQ((pairs[0].*member).matrix()(1, 0), 1);
    EXPECT_EQ((pairs[0].*member).translation(), Eigen::Vector3d(0.1, 0.2, 0.3));
    EXPECT_EQ((pairs[1].*member).matrix()(2, 2), -1);
    EXPECT_EQ((pairs[1].*member).translation(), Eigen::Vector3d(0.4, 0.5, 0.6));
  }
}

TEST(PairsOfNumpy, AreReadAsMatrices) {
  const TemporaryFolder folder;
  const std::vector<std::string> robots = {"robot", "gripper_poses", "T_base_ee"},
                                 targets = {"target", "Board", "T_cam_board"};
  for (std::size_t i = 0; i < robots.size(); ++i)
    expect_both(load_pose_pairs(folder.write("pairs.npz", npz_text({{targets[i], {2, 4, 4}, kMatrices},
                                                                    {"ids", {2}, {7, 8}},
                                                                    {robots[i], {2, 4, 4}, kMatrices}}))));
}

// numpy.save keeps the order of a stack that is transposed.
TEST(PairsOfNumpy, AreReadInEitherOrder) {
  const TemporaryFolder folder;
  std::vector<double> stored;
  for (int column = 0; column < 4; ++column)
    for (int row = 0; row < 4; ++row)
      for (const double* pose : {kFirst, kSecond}) stored.push_back(pose[4 * row + column]);
  const NamedArray robot{"robot", {2, 4, 4}, stored, "<f8", true};
  expect_both(
      load_pose_pairs(folder.write("pairs.npz", npz_text({robot, {"target", {2, 4, 4}, kMatrices}}))));
}

TEST(PairsOfNumpy, AreReadAsOpenCvTakesThem) {
  const TemporaryFolder folder;
  const std::vector<double> R = both([](int row, int column) { return row < 3 && column < 3; }),
                            t = both([](int row, int column) { return row < 3 && column == 3; });
  expect_both(load_pose_pairs(folder.write("pairs.npz", npz_text({{"R_gripper2base", {2, 3, 3}, R},
                                                                  {"t_gripper2base", {2, 3, 1}, t},
                                                                  {"R_target2cam", {2, 3, 3}, R},
                                                                  {"t_target2cam", {2, 3}, t}}))));
}

TEST(PairsOfNumpy, AreReadWithRotationVectors) {
  const TemporaryFolder folder;
  std::vector<double> vectors;
  for (const double* matrix : {kFirst, kSecond}) {
    Eigen::Matrix3d R;
    for (int i = 0; i < 9; ++i) R(i / 3, i % 3) = matrix[4 * (i / 3) + i % 3];
    const Eigen::AngleAxisd turn(R);
    for (const double value : Eigen::Vector3d(turn.angle() * turn.axis())) vectors.push_back(value);
  }
  const std::vector<double> t = both([](int row, int column) { return row < 3 && column == 3; });
  expect_both(load_pose_pairs(folder.write("pairs.npz", npz_text({{"R_gripper2base", {2, 3}, vectors},
                                                                  {"t_gripper2base", {2, 3}, t},
                                                                  {"R_target2cam", {2, 3, 1}, vectors},
                                                                  {"t_target2cam", {2, 3}, t}}))));
}

TEST(PosesOfNumpy, AreTheRobotsOrTheOnlyArray) {
  const TemporaryFolder folder;
  for (const char* name : {"T_base_ee", "arr_0"}) {
    const PoseList list = load_pose_list(folder.write("poses.npz", npz_text({{name, {2, 4, 4}, kMatrices}})));
    ASSERT_EQ(list.poses.size(), 2U);
    EXPECT_TRUE(list.in_order);
    EXPECT_NEAR(list.poses[1].pose.linear()(0, 0), kMatrices[16], 1e-12);
    EXPECT_NEAR(list.poses[1].pose.translation().y(), kMatrices[16 + 7], 1e-12);
  }
  const std::string said = input_error_of([&] {
    load_pose_list(
        folder.write("poses.npz", npz_text({{"a", {2, 4, 4}, kMatrices}, {"b", {2, 4, 4}, kMatrices}})));
  });
  EXPECT_NE(said.find("poses.npz: found a 2 x 4 x 4, b 2 x 4 x 4, expected"), std::string::npos) << said;
}

TEST(PairsOfNumpy, ThatAreNoneAreToldWhatWasFoundAndExpected) {
  const TemporaryFolder folder;
  const auto said = [&](const std::vector<NamedArray>& arrays) {
    return input_error_of([&] { load_pose_pairs(folder.write("pairs.npz", npz_text(arrays))); });
  };
  const std::string unnamed = said({{"arr_0", {2, 4, 4}, kMatrices}, {"arr_1", {2, 4, 4}, kMatrices}});
  for (const auto& [type, found] :
       {std::pair("|O", "objects (|O)"), std::pair("<c8", "complex numbers (<c8)"),
        std::pair("<U16", "text (<U16)"), std::pair("|b1", "truth values (|b1)")}) {
    const std::string text = said({{"Robot", {2, 4, 4}, kMatrices, type}, {"target", {2, 4, 4}, kMatrices}});
    EXPECT_TRUE(text.ends_with("pairs.npz: Robot: found " + std::string(found) +
                               ", expected real numbers, as numpy.float64"))
        << text;
  }
  // What is not asked for may hold anything.
  expect_both(load_pose_pairs(folder.write("pairs.npz", npz_text({{"target", {2, 4, 4}, kMatrices},
                                                                  {"names", {2}, {7, 8}, "<U2"},
                                                                  {"robot", {2, 4, 4}, kMatrices}}))));
  EXPECT_NE(unnamed.find("pairs.npz: found arr_0 2 x 4 x 4, arr_1 2 x 4 x 4, expected as many poses"),
            std::string::npos)
      << unnamed;
  const std::vector<double> one(kMatrices.begin(), kMatrices.begin() + 16);
  const std::string fewer = said({{"robot", {2, 4, 4}, kMatrices}, {"target", {1, 4, 4}, one}});
  EXPECT_NE(fewer.find("found robot 2 x 4 x 4, target 1 x 4 x 4"), std::string::npos) << fewer;
  EXPECT_NE(said({{"robot", {2, 4, 4}, kMatrices},
                  {"ROBOT", {2, 4, 4}, kMatrices},
                  {"target", {2, 4, 4}, kMatrices}})
                .find("found another array of this name but for capitals and signs"),
            std::string::npos);
  for (const double wrong : {std::nan(""), HUGE_VAL})
    for (const std::size_t entry : {16, 19}) {  // of a rotation and of a place
      std::vector<double> spoilt = kMatrices;
      spoilt[entry] = wrong;
      const std::string text = said({{"robot", {2, 4, 4}, kMatrices}, {"target", {2, 4, 4}, spoilt}});
      EXPECT_NE(text.find("pair 1: found "), std::string::npos) << text;
    }
  for (const double wrong : {std::nan(""), 1e300})
    EXPECT_NE(said({{"R_gripper2base", {1, 3}, {0, wrong, 0}},
                    {"t_gripper2base", {1, 3}, {0, 0, 0}},
                    {"R_target2cam", {1, 3}, {0, 0, 0}},
                    {"t_target2cam", {1, 3}, {0, 0, 1}}})
                  .find("R_gripper2base: found a rotation vector of length "),
              std::string::npos);
  EXPECT_NE(
      said({{"robot", {1, 7}, {0, 0, 0, 0, std::nan(""), 0, 1}}, {"target", {1, 7}, {0, 0, 1, 0, 0, 0, 1}}})
          .find("pair 0: quaternion has length "),
      std::string::npos);
  std::vector<double> skewed = kMatrices;
  skewed[16] = 0.9;
  EXPECT_NE(said({{"robot", {2, 4, 4}, skewed}, {"target", {2, 4, 4}, kMatrices}}).find("pair 1"),
            std::string::npos);
}

}  // namespace
}  // namespace flash::data
