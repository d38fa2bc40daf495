#pragma once
#include "calib/geometry/arm_model.h"
#include "tests/calib/arm_scene.h"

namespace flash::calib {

/// The arm of the scenes: turn about z, then the link of Denavit and Hartenberg.
inline SerialChain chain_of(const Arm& arm) {
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

/// What is wrong with the description of an arm: zeros [rad] and lengths [m], as of error_motions().
struct WrongArm {
  Eigen::VectorXd zeros, lengths;
};

/// The arm of the scenes with links shorter than they are by `lengths`, which may be empty.
inline ArmModel described_arm(const Eigen::VectorXd& lengths, double length_sd) {
  ArmModel arm{.chain = chain_of(nominal_arm()), .lengths = {}, .length_sd = length_sd};
  const std::vector<LinkLength> all = link_lengths(arm.chain);
  for (Eigen::Index i = 0; i < lengths.size(); ++i) {
    const LinkLength& length = all[static_cast<std::size_t>(i)];
    arm.chain.joints[length.joint].origin.translation() -= lengths[i] * length.direction;
  }
  return arm;
}

/// What the recording's readers know of the arm.
enum class Known { poses, joints, joints_and_lengths };

/// Of an arm that repeats to 0.005 deg and 0.03 mm.
inline Vector6d robot_noise(std::mt19937& random) {
  std::normal_distribution<double> normal;
  Vector6d noise;
  for (Eigen::Index k = 0; k < 6; ++k) noise[k] = (k < 3 ? 3e-5 : 0.005 * M_PI / 180) * normal(random);
  return noise;
}

/// A recording of 25 views by such an arm, which is not as described.
inline HandEyeScene recorded(const WrongArm& wrong, Known known, unsigned seed,
                             Setup setup = Setup::eye_in_hand, double length_sd = kUsualLinkLength,
                             double reach = 0.4) {
  SceneSettings settings = protocol_settings(setup);
  settings.views = 25;
  HandEyeScene scene = make_arm_scene(settings, {}, reach, board_points(), seed);
  ArmModel arm = described_arm(wrong.lengths, length_sd);
  if (known == Known::joints_and_lengths) arm.lengths = link_lengths(arm.chain);
  std::mt19937 random(seed);
  for (std::size_t i = 0; i < scene.observations.size(); ++i) {
    const Eigen::VectorXd said = scene.joints[i] - wrong.zeros;
    Observation& observation = scene.observations[i];
    observation.T_base_gripper = moved(gripper_pose(arm.chain, said), robot_noise(random));
    if (known == Known::poses) continue;
    observation.joint_motions = error_motions(arm, said);
    observation.joint_sd = prior_deviations(arm);
  }
  return scene;
}

/// Zeros off by kUsualJointZero and lengths by length_sd, one standard deviation; 0: lengths are right.
inline WrongArm draw_wrong_arm(unsigned seed, double length_sd) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  const auto drawn = [&](Eigen::Index count, double sd) {
    Eigen::VectorXd values(count);
    for (double& value : values) value = sd * normal(random);
    return values;
  };
  const auto lengths = static_cast<Eigen::Index>(link_lengths(chain_of(nominal_arm())).size());
  WrongArm wrong;
  wrong.zeros = drawn(6, kUsualJointZero);
  wrong.lengths = drawn(lengths, length_sd);
  return wrong;
}

}  // namespace flash::calib
