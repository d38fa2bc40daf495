#include "calib/geometry/serial_chain.h"

namespace flash::calib {

const char* to_string(Joint::Kind kind) {
  switch (kind) {
    case Joint::Kind::revolute:
      return "revolute";
    case Joint::Kind::prismatic:
      return "prismatic";
    case Joint::Kind::fixed:
      break;
  }
  return "fixed";
}

Vector6d motion_of(const Joint& joint) {
  Vector6d xi = Vector6d::Zero();
  if (joint.kind == Joint::Kind::revolute) xi.tail<3>() = joint.axis;
  if (joint.kind == Joint::Kind::prismatic) xi.head<3>() = joint.axis;
  return xi;
}

std::vector<Eigen::Isometry3d> gripper_behind(const SerialChain& chain, const Eigen::VectorXd& q) {
  std::vector<Eigen::Isometry3d> poses(chain.joints.size() + 1, Eigen::Isometry3d::Identity());
  Eigen::Index moving = q.size();
  for (std::size_t k = chain.joints.size(); k-- > 0;) {
    const Joint& joint = chain.joints[k];
    const double value = joint.kind == Joint::Kind::fixed ? 0 : q[--moving];
    poses[k] = joint.origin * moved(Eigen::Isometry3d::Identity(), value * motion_of(joint)) * poses[k + 1];
  }
  return poses;
}

std::vector<std::string> moving_joints(const SerialChain& chain) {
  std::vector<std::string> names;
  for (const Joint& joint : chain.joints)
    if (joint.kind != Joint::Kind::fixed) names.push_back(joint.name);
  return names;
}

Eigen::Isometry3d gripper_pose(const SerialChain& chain, const Eigen::VectorXd& q) {
  return gripper_behind(chain, q).front();
}

Eigen::Matrix<double, 6, Eigen::Dynamic> joint_motions(const SerialChain& chain, const Eigen::VectorXd& q) {
  const std::vector<Eigen::Isometry3d> poses = gripper_behind(chain, q);
  Eigen::Matrix<double, 6, Eigen::Dynamic> J(6, q.size());
  Eigen::Index column = 0;
  for (std::size_t k = 0; k < chain.joints.size(); ++k)
    if (chain.joints[k].kind != Joint::Kind::fixed)
      J.col(column++) = adjoint(poses[k + 1].inverse()) * motion_of(chain.joints[k]);
  return J;
}

}  // namespace flash::calib
