#pragma once
#include <Eigen/Core>
#include <vector>

#include "calib/geometry/closed_form.h"

namespace flash::calib {

/// X and Z where there are poses of the target, but no corners.
struct PoseSpaceFit {
  HandEyePoses poses;
  Eigen::Matrix<double, 12, 12> covariance;  ///< of (X, Z), right perturbations (dt, dtheta)
  double rotation = 0;     ///< noise of the closed chain per axis, robot and camera together [rad]
  double translation = 0;  ///< likewise [m]
  bool converged = false;
};

/// Minimises the sum over views of |dt|^2 / translation^2 + |dtheta|^2 / rotation^2, (dt, dtheta) the motion
/// between the target as predicted, X^-1 G^-1 Z, and as seen, C; both noise levels by restricted maximum
/// likelihood. Gauss and Newton.
PoseSpaceFit fit_pose_space(const std::vector<PoseLoop>& loops, const HandEyePoses& seed);

}  // namespace flash::calib
