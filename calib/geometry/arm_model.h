#pragma once
#include <cmath>
#include <string>
#include <vector>

#include "calib/geometry/serial_chain.h"

namespace flash::calib {

/// Of the zeros of joints of arms in use, one standard deviation [rad].
constexpr double kUsualJointZero = 0.1 * M_PI / 180;
/// Of lengths of machined links [m]: ISO 2768-m allows 0.3 to 0.8 mm for lengths of 30 mm to 1 m.
constexpr double kUsualLinkLength = 0.3e-3;

/// A length of an arm that may be wrong: the origin of a joint is shifted along a direction.
struct LinkLength {
  std::size_t joint = 0;      ///< of SerialChain::joints
  Eigen::Vector3d direction;  ///< in the frame of the joint before, of length 1
};

/// An arm as described, and what may be wrong in it: the zeros of its joints, then lengths of its links.
struct ArmModel {
  SerialChain chain;
  std::vector<LinkLength> lengths = {};  ///< empty: the links are as described
  double length_sd = kUsualLinkLength;   ///< of each, known beforehand [m]
};

/// All lengths of a chain that differ in what they do: of a joint that turns those across its axis, and of a
/// part behind the last moving joint all three. A shift along the axis of a joint is one of the joint behind
/// it, and shifts before a joint that slides are too (Everett, Driels, Mooring 1987). 2 r + 3 of r joints
/// that turn. Along axes of coordinates where the joint's axis is one.
std::vector<LinkLength> link_lengths(const SerialChain& chain);

/// How the gripper moves in its own frame with the zero of each moving joint, then with each length: columns
/// (dt, dtheta) as of joint_motions(). q: of the joints that move [rad, m].
Eigen::Matrix<double, 6, Eigen::Dynamic> error_motions(const ArmModel& arm, const Eigen::VectorXd& q);

/// Their standard deviations beforehand [rad, m].
Eigen::VectorXd prior_deviations(const ArmModel& arm);

/// The chain with the errors in its origins: at q it is where the described arm would be at q + zeros, with
/// links so much longer. errors: as of error_motions() [rad, m].
SerialChain corrected_chain(const ArmModel& arm, const Eigen::VectorXd& errors);

/// A joint as described, and where corrected_chain() has it in the frame of the joint before.
struct JointOrigin {
  Joint joint;
  Eigen::Isometry3d corrected = joint.origin;
};

/// Of all joints, from the base to the gripper.
std::vector<JointOrigin> joint_origins(const ArmModel& arm, const Eigen::VectorXd& errors);

}  // namespace flash::calib
