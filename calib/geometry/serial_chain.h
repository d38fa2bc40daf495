#pragma once
#include <Eigen/Geometry>
#include <cmath>
#include <string>
#include <vector>

namespace flash::calib {

/// A joint of a robot arm and the link before it.
struct Joint {
  enum class Kind { fixed, revolute, prismatic };
  std::string name;
  Kind kind = Kind::fixed;
  Eigen::Isometry3d origin = Eigen::Isometry3d::Identity();  ///< of the joint, in the frame of the one before
  Eigen::Vector3d axis = Eigen::Vector3d::UnitX();           ///< in its own frame, of length 1
};

/// Joints one after the other, from the base to the gripper.
struct SerialChain {
  std::vector<Joint> joints;
};

/// Of the joints that move, in order.
std::vector<std::string> moving_joints(const SerialChain& chain);

/// T_base_gripper = prod origin_k motion_k(q_k). q: of the joints that move [rad, m].
Eigen::Isometry3d gripper_pose(const SerialChain& chain, const Eigen::VectorXd& q);

/// Of arms in use, standard deviations: zeros of joints, places and directions of their axes.
constexpr double kUsualJointZero = 0.1 * M_PI / 180;  ///< [rad]
constexpr double kUsualAxisPlace = 3e-4;              ///< [m]
constexpr double kUsualAxisTilt = 0.03 * M_PI / 180;  ///< [rad]

constexpr Eigen::Index kErrorsOfJoint = 6;  ///< its zero, its axis' place and tilt

/// How the gripper moves with each joint, in its own frame: columns (dt, dtheta) with
/// T(q + d) = moved(T(q), J d) to first order.
Eigen::Matrix<double, 6, Eigen::Dynamic> joint_motions(const SerialChain& chain, const Eigen::VectorXd& q);

/// The same of all that a chain may be wrong in: kErrorsOfJoint columns for each of n joints that move. First
/// the n joints as above. Then, joint by joint, the place of its axis along its own x, y and z, and its tilt
/// about two directions across, in units in which kUsualJointZero is the standard deviation of these as well.
Eigen::Matrix<double, 6, Eigen::Dynamic> model_motions(const SerialChain& chain, const Eigen::VectorXd& q);

}  // namespace flash::calib
