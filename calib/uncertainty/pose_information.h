#pragma once
#include <Eigen/Core>
#include <vector>

#include "calib/solve/errors_in_variables.h"

namespace flash::calib {

/// What the pictures say of one pose's error xi (base axes, at the gripper) and of the shared unknowns s:
/// half of xi^T H xi + 2 xi^T H_s s + s^T H_ss s + 2 xi^T g + 2 s^T g_s.
struct PoseInformation {
  Matrix6d H = Matrix6d::Zero();
  Eigen::Matrix<double, 6, Eigen::Dynamic> H_s;
  Eigen::MatrixXd H_ss;
  Vector6d g = Vector6d::Zero();
  Eigen::VectorXd g_s;
  Matrix6d prior = Matrix6d::Zero();  ///< information of the prior that the solution was made with
};

/// Of every pose, linearised at the solution and asked of the whole error.
std::vector<PoseInformation> pose_informations(const Refinement& refined, const BundleSettings& settings);

}  // namespace flash::calib
