#include "calib/uncertainty/joint_zeros.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "calib/calibrate/calibrate.h"
#include "calib/calibrate/cell.h"
#include "calib/geometry/serial_chain.h"
#include "tests/calib/arm_scene.h"
#include "tests/calib/cell_member.h"

namespace flash::calib {
namespace {

/// The arm of the scenes: turn about z, then the link of Denavit and Hartenberg.
SerialChain chain_of(const Arm& arm) {
  SerialChain chain;
  Eigen::Isometry3d origin = Eigen::Isometry3d::Identity();
  for (const Arm::Joint& joint : arm.joints) {
    chain.joints.push_back({"", Joint::Kind::revolute, origin, Eigen::Vector3d::UnitZ()});
    origin =
        Eigen::Translation3d(joint.a, 0, joint.d) * Eigen::AngleAxisd(joint.alpha, Eigen::Vector3d::UnitX());
  }
  chain.joints.push_back({"flange", Joint::Kind::fixed, origin, Eigen::Vector3d::UnitX()});
  return chain;
}

TEST(JointZeros, ChainsOfJointsAreTheArmInClosedForm) {
  Eigen::Matrix<double, 6, 1> q;
  q << 0.3, -1.6, 1.5, -1.4, -1.57, 0.2;
  EXPECT_TRUE(gripper_pose(chain_of(nominal_arm()), q).isApprox(nominal_arm().pose(q), 1e-12));
}

/// A recording of an arm whose joints are farther than they say by `zeros`; it repeats to 0.005 deg and 0.03
/// mm.
HandEyeScene recorded(const Eigen::VectorXd& zeros, bool with_joints, unsigned seed,
                      Setup setup = Setup::eye_in_hand) {
  SceneSettings settings = protocol_settings(setup);
  settings.views = 25;
  HandEyeScene scene = make_arm_scene(settings, {}, 0.4, board_points(), seed);
  const SerialChain chain = chain_of(nominal_arm());
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  for (std::size_t i = 0; i < scene.observations.size(); ++i) {
    const Eigen::VectorXd said = scene.joints[i] - zeros;
    Vector6d noise;
    for (Eigen::Index k = 0; k < 6; ++k) noise[k] = (k < 3 ? 3e-5 : 0.005 * M_PI / 180) * normal(random);
    scene.observations[i].T_base_gripper = moved(gripper_pose(chain, said), noise);
    if (with_joints) scene.observations[i].joint_motions = joint_motions(chain, said);
  }
  return scene;
}

TEST(JointZeros, AreFoundAndTakeTheirErrorOutOfTheAnswer) {
  constexpr unsigned kTrials = 10, kCompared = 3;
  constexpr double kChiSquare95 = 12.592;
  double with_joints = 0, without = 0, squared = 0;
  int inside = 0;
  for (unsigned trial = 0; trial < kTrials; ++trial) {
    std::mt19937 random(900 + trial);
    std::normal_distribution<double> normal(0, kUsualJointZero);
    Eigen::VectorXd zeros(6);
    for (double& zero : zeros) zero = normal(random);
    for (const bool known : {false, true}) {
      if (!known && trial >= kCompared) continue;
      const HandEyeScene scene = recorded(zeros, known, 900 + trial);
      CalibrateSettings settings;
      settings.folds = 2;
      const Calibration result = calibrate(Setup::eye_in_hand, scene.camera, scene.points,
                                           grid_symmetries(scene.points), scene.observations, settings);
      const Vector6d error = motion_between(result.poses.X, scene.truth.X);
      if (trial < kCompared) (known ? with_joints : without) += error.head<3>().squaredNorm();
      const std::optional<JointZeros> found =
          joint_zeros(result.refined.bundle, result.unknowns, result.shared_covariance);
      ASSERT_EQ(found.has_value(), known);
      if (!known) continue;
      inside += error.dot(result.covariance.ldlt().solve(error)) < kChiSquare95;
      squared += ((found->estimate - zeros).array() / found->sd.array()).square().mean() / kTrials;
      // The joints between the first and the last turn camera and target against each other.
      EXPECT_LT(found->sd.segment<4>(1).maxCoeff(), 0.5 * kUsualJointZero);
    }
  }
  EXPECT_LT(with_joints, without);
  EXPECT_GE(inside, 8);     // of ten at 95 %: fewer once in eighty
  EXPECT_GT(squared, 0.4);  // 60 squares of unit mean, six of a trial correlated: 0.26 a standard deviation
  EXPECT_LT(squared, 1.8);
}

TEST(JointZeros, OfTwoArmsOnOneCameraAreSolvedForTogether) {
  constexpr double kChiSquare999 = 22.458;  // 6 degrees of freedom
  std::mt19937 random(950);
  std::normal_distribution<double> normal(0, kUsualJointZero);
  std::array<Eigen::VectorXd, 2> zeros = {Eigen::VectorXd(6), Eigen::VectorXd(6)};
  for (Eigen::VectorXd& of_arm : zeros)
    for (double& zero : of_arm) zero = normal(random);
  std::array<double, 2> off{};
  for (const bool known : {false, true}) {
    const HandEyeScene left = recorded(zeros[0], known, 950, Setup::eye_to_hand),
                       right = recorded(zeros[1], known, 951, Setup::eye_to_hand);
    const Cell cell = solve_cell({member_of(left, "left"), member_of(right, "right")});
    const Vector6d error = motion_between(cell.bases[0].transform.T, left.truth.X * right.truth.X.inverse());
    off[known ? 1 : 0] = error.head<3>().norm();
    if (!known) continue;
    EXPECT_LT(error.dot(cell.bases[0].covariance.ldlt().solve(error)), kChiSquare999);
  }
  EXPECT_LT(off[1], off[0]);
}

TEST(JointZeros, OfOneArmOfTwoAreNotSolvedFor) {
  const Eigen::VectorXd zeros = Eigen::VectorXd::Zero(6);
  std::vector<std::string> notices;
  const Bundle bundle = cell_bundle({member_of(recorded(zeros, true, 960, Setup::eye_to_hand), "left"),
                                     member_of(recorded(zeros, false, 961, Setup::eye_to_hand), "right")},
                                    &notices);
  EXPECT_TRUE(bundle.joint_zeros.empty());
  for (const RobotPose& pose : bundle.poses) EXPECT_EQ(pose.joint_motions.cols(), 0);
  ASSERT_EQ(notices.size(), 1U);
}

}  // namespace
}  // namespace flash::calib
