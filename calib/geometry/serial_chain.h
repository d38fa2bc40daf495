#pragma once
#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "calib/geometry/pose.h"

namespace flash::calib {

/// A joint of a robot arm and the link before it.
struct Joint {
  enum class Kind { fixed, revolute, prismatic };
  std::string name;
  Kind kind = Kind::fixed;
  Eigen::Isometry3d origin = Eigen::Isometry3d::Identity();  ///< of the joint, in the frame of the one before
  Eigen::Vector3d axis = Eigen::Vector3d::UnitX();           ///< in its own frame, of length 1
};

const char* to_string(Joint::Kind kind);

/// Joints one after the other, from the base to the gripper.
struct SerialChain {
  std::vector<Joint> joints;
};

/// (dt, dtheta) of the joint's own frame per unit of the joint; zero of a fixed one.
Vector6d motion_of(const Joint& joint);

/// Of the joints that move, in order.
std::vector<std::string> moving_joints(const SerialChain& chain);

/// T_base_gripper = prod origin_k motion_k(q_k). q: of the joints that move [rad, m].
Eigen::Isometry3d gripper_pose(const SerialChain& chain, const Eigen::VectorXd& q);

/// The gripper in the frame before each joint, and in its own at last.
std::vector<Eigen::Isometry3d> gripper_behind(const SerialChain& chain, const Eigen::VectorXd& q);

/// How the gripper moves with each joint, in its own frame: columns (dt, dtheta) with
/// T(q + d) = moved(T(q), J d) to first order.
Eigen::Matrix<double, 6, Eigen::Dynamic> joint_motions(const SerialChain& chain, const Eigen::VectorXd& q);

}  // namespace flash::calib
