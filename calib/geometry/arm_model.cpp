#include "calib/geometry/arm_model.h"

#include "calib/geometry/pose.h"

namespace flash::calib {
namespace {

/// Two directions across an axis: coordinate axes where it is one.
std::vector<Eigen::Vector3d> across(const Eigen::Vector3d& axis) {
  Eigen::Index least = 0, most = 0;
  axis.cwiseAbs().minCoeff(&least);
  const Eigen::Vector3d unit = Eigen::Vector3d::Unit(least);
  const Eigen::Vector3d first = (unit - unit.dot(axis) * axis).normalized();
  Eigen::Vector3d second = axis.cross(first);
  second.cwiseAbs().maxCoeff(&most);
  if (second[most] < 0) second = -second;
  return {first, second};
}

}  // namespace

std::vector<LinkLength> link_lengths(const SerialChain& chain) {
  std::vector<LinkLength> lengths;
  std::size_t behind = 0;  // the last moving joint
  for (std::size_t k = 0; k < chain.joints.size(); ++k) {
    const Joint& joint = chain.joints[k];
    if (joint.kind == Joint::Kind::fixed) continue;
    behind = k + 1;
    if (joint.kind == Joint::Kind::prismatic) continue;
    for (const Eigen::Vector3d& direction : across(joint.origin.linear() * joint.axis))
      lengths.push_back({k, direction});
  }
  if (behind < chain.joints.size())
    for (Eigen::Index axis = 0; axis < 3; ++axis) lengths.push_back({behind, Eigen::Vector3d::Unit(axis)});
  return lengths;
}

Eigen::Matrix<double, 6, Eigen::Dynamic> error_motions(const ArmModel& arm, const Eigen::VectorXd& q) {
  const Eigen::Matrix<double, 6, Eigen::Dynamic> zeros = joint_motions(arm.chain, q);
  const auto count = static_cast<Eigen::Index>(arm.lengths.size());
  Eigen::Matrix<double, 6, Eigen::Dynamic> J =
      Eigen::Matrix<double, 6, Eigen::Dynamic>::Zero(6, q.size() + count);
  J.leftCols(q.size()) = zeros;
  const std::vector<Eigen::Isometry3d> gripper = gripper_behind(arm.chain, q);
  for (Eigen::Index i = 0; i < count; ++i) {
    const LinkLength& length = arm.lengths[static_cast<std::size_t>(i)];
    J.col(q.size() + i).head<3>() = gripper[length.joint].linear().transpose() * length.direction;
  }
  return J;
}

Eigen::VectorXd prior_deviations(const ArmModel& arm) {
  constexpr double kUsualRailZero = 1e-3;  // [m]
  std::vector<double> sd;
  for (const Joint& joint : arm.chain.joints)
    if (joint.kind != Joint::Kind::fixed)
      sd.push_back(joint.kind == Joint::Kind::revolute ? kUsualJointZero : kUsualRailZero);
  sd.insert(sd.end(), arm.lengths.size(), arm.length_sd);
  return Eigen::VectorXd::Map(sd.data(), static_cast<Eigen::Index>(sd.size()));
}

SerialChain corrected_chain(const ArmModel& arm, const Eigen::VectorXd& errors) {
  SerialChain chain = arm.chain;
  Eigen::Index next = 0;
  for (Joint& joint : chain.joints)
    if (joint.kind != Joint::Kind::fixed)
      joint.origin = moved(joint.origin, errors[next++] * motion_of(joint));
  for (const LinkLength& length : arm.lengths)
    chain.joints[length.joint].origin.translation() += errors[next++] * length.direction;
  return chain;
}

std::vector<JointOrigin> joint_origins(const ArmModel& arm, const Eigen::VectorXd& errors) {
  const SerialChain corrected = corrected_chain(arm, errors);
  std::vector<JointOrigin> origins;
  for (std::size_t k = 0; k < corrected.joints.size(); ++k)
    origins.push_back({arm.chain.joints[k], corrected.joints[k].origin});
  return origins;
}

}  // namespace flash::calib
