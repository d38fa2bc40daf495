#include "calib/geometry/arm_model.h"

#include <gtest/gtest.h>

#include <Eigen/QR>

#include "tests/calib/joint_scene.h"

namespace flash::calib {
namespace {

/// A rail, then joints about axes aslant and parallel, and a tool behind a part of its own.
SerialChain odd_chain() {
  const auto origin = [](double x, double y, double z, double roll, double yaw) {
    return make_pose({x, y, z}, Eigen::Vector3d(roll, 0.2 * roll, yaw));
  };
  using Kind = Joint::Kind;
  SerialChain chain;
  chain.joints = {{"rail", Kind::prismatic, origin(0.1, 0, 0.3, 0.2, 0.1), Eigen::Vector3d::UnitX()},
                  {"shoulder", Kind::revolute, origin(0, 0.1, 0.2, 0, 0.4), Eigen::Vector3d::UnitZ()},
                  {"plate", Kind::fixed, origin(0.1, 0.1, 0, 0.3, 0), Eigen::Vector3d::UnitX()},
                  {"elbow", Kind::revolute, origin(0.4, 0, 0, 0, 0), Eigen::Vector3d(1, 2, 2) / 3},
                  {"fore", Kind::revolute, origin(0.3, 0, 0.1, 0, 0), Eigen::Vector3d(1, 2, 2) / 3},
                  {"wrist", Kind::revolute, origin(0.2, 0.1, 0, 1.2, 0.3), Eigen::Vector3d::UnitY()},
                  {"flange", Kind::fixed, origin(0, 0, 0.1, 0, 0.5), Eigen::Vector3d::UnitX()},
                  {"tool", Kind::fixed, origin(0.1, 0, 0, 0, 0), Eigen::Vector3d::UnitX()}};
  return chain;
}

Eigen::VectorXd drawn(Eigen::Index count, double size, std::mt19937& random) {
  std::uniform_real_distribution<double> uniform(-size, size);
  Eigen::VectorXd values(count);
  for (double& value : values) value = uniform(random);
  return values;
}

TEST(ArmModel, LengthsAreAcrossTheAxesAndOfTheToolAll) {
  const std::vector<LinkLength> lengths = link_lengths(odd_chain());
  ASSERT_EQ(lengths.size(), 2U * 4 + 3);
  const SerialChain chain = odd_chain();
  for (std::size_t i = 0; i + 3 < lengths.size(); ++i) {
    const Joint& joint = chain.joints[lengths[i].joint];
    EXPECT_NEAR(lengths[i].direction.norm(), 1, 1e-14);
    EXPECT_NEAR(lengths[i].direction.dot(joint.origin.linear() * joint.axis), 0, 1e-14);
  }
  EXPECT_EQ(chain.joints[lengths.back().joint].name, "flange");
  // The axes of the simulated arm are coordinates' in the frames before them.
  for (const LinkLength& length : link_lengths(chain_of(nominal_arm())))
    EXPECT_NEAR(length.direction.cwiseAbs().maxCoeff(), 1, 1e-12);
}

// The columns of all shifts of all origins, over many poses, against those that are kept: as many as these
// are independent, and the others add nothing.
TEST(ArmModel, LengthsAreAllShiftsAndNoneTwice) {
  const SerialChain chain = odd_chain();
  ArmModel all{.chain = chain}, kept{.chain = chain, .lengths = link_lengths(chain)};
  for (std::size_t k = 0; k < chain.joints.size(); ++k)
    for (Eigen::Index axis = 0; axis < 3; ++axis) all.lengths.push_back({k, Eigen::Vector3d::Unit(axis)});
  std::mt19937 random(3);
  constexpr Eigen::Index kPoses = 40, kJoints = 5;
  const auto a = static_cast<Eigen::Index>(all.lengths.size()),
             b = static_cast<Eigen::Index>(kept.lengths.size());
  Eigen::MatrixXd of_all(6 * kPoses, a), of_both(6 * kPoses, a + b), of_kept(6 * kPoses, b);
  for (Eigen::Index i = 0; i < kPoses; ++i) {
    const Eigen::VectorXd q = drawn(kJoints, 2, random);
    of_all.middleRows(6 * i, 6) = error_motions(all, q).rightCols(a);
    of_kept.middleRows(6 * i, 6) = error_motions(kept, q).rightCols(b);
  }
  of_both << of_all, of_kept;
  EXPECT_EQ(Eigen::ColPivHouseholderQR<Eigen::MatrixXd>(of_kept).rank(), b);
  EXPECT_EQ(Eigen::ColPivHouseholderQR<Eigen::MatrixXd>(of_all).rank(), b);
  EXPECT_EQ(Eigen::ColPivHouseholderQR<Eigen::MatrixXd>(of_both).rank(), b);
}

TEST(ArmModel, MotionsAreDerivativesOfTheCorrectedChain) {
  ArmModel arm{.chain = odd_chain()};
  arm.lengths = link_lengths(arm.chain);
  std::mt19937 random(4);
  const Eigen::VectorXd q = drawn(5, 1.5, random);
  const auto J = error_motions(arm, q);
  const Eigen::Isometry3d T = gripper_pose(arm.chain, q);
  constexpr double kStep = 1e-6;
  for (Eigen::Index i = 0; i < J.cols(); ++i) {
    const Eigen::VectorXd step = kStep * Eigen::VectorXd::Unit(J.cols(), i);
    const Vector6d ahead = motion_between(T, gripper_pose(corrected_chain(arm, step), q)),
                   behind = motion_between(T, gripper_pose(corrected_chain(arm, -step), q));
    // h^2 of truncation, and rounding over h: 1e-16 / 1e-6.
    EXPECT_LT(((ahead - behind) / (2 * kStep) - J.col(i)).cwiseAbs().maxCoeff(), 1e-9) << i;
  }
}

TEST(ArmModel, ACorrectedChainIsTheMotionToFirstOrder) {
  ArmModel arm{.chain = chain_of(nominal_arm())};
  arm.lengths = link_lengths(arm.chain);
  const WrongArm wrong = draw_wrong_arm(5, 1e-3);
  Eigen::VectorXd errors(21);
  errors << wrong.zeros, wrong.lengths;
  const Eigen::VectorXd q = (Eigen::VectorXd(6) << 0.3, -1.6, 1.5, -1.4, -1.57, 0.2).finished();
  const Vector6d apart = motion_between(moved(gripper_pose(arm.chain, q), error_motions(arm, q) * errors),
                                        gripper_pose(corrected_chain(arm, errors), q));
  // Second order: turns of all joints together, times themselves over the reach of 0.9 m or times lengths.
  const double turn = errors.head<6>().lpNorm<1>(), shift = errors.tail<15>().lpNorm<1>();
  EXPECT_LT(apart.head<3>().norm(), turn * turn * 0.9 + turn * shift);
  EXPECT_LT(apart.tail<3>().norm(), turn * turn);
  EXPECT_GT(apart.norm(), 0);
}

}  // namespace
}  // namespace flash::calib
