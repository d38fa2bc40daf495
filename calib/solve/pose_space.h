#pragma once
#include <Eigen/Core>
#include <limits>
#include <optional>
#include <vector>

#include "calib/geometry/closed_form.h"

namespace flash::calib {

/// X and Z where there are poses of the target, but no corners.
struct PoseSpaceFit {
  HandEyePoses poses;
  Eigen::MatrixXd covariance;  ///< of (X, Z), right perturbations (dt, dtheta), and the log of the size where
                               ///< that is an unknown
  double size = 1;             ///< of the target, true over stated
  double rotation = 0;         ///< noise of the closed chain per axis, robot and camera together [rad]
  double translation = 0;      ///< likewise [m]
  bool converged = false;
};

/// The size of the target as an unknown.
struct SizeUnknown {
  double prior_sd = std::numeric_limits<double>::infinity();  ///< of it, about the stated one
  /// How much of the noise of places is the camera's. Noise makes lengths look larger than they are: a
  /// robot's noise the target too large, a camera's too small. Pairs do not tell whose it is.
  double camera_share = 0.5;
};

/// Minimises the sum over views of |dt|^2 / translation^2 + |dtheta|^2 / rotation^2, (dt, dtheta) the motion
/// between the target as predicted, X^-1 G^-1 Z, and as seen, C; both noise levels by restricted maximum
/// likelihood. Gauss and Newton. size: the target as seen is so many times as far away; none: it is as
/// stated.
PoseSpaceFit fit_pose_space(const std::vector<PoseLoop>& loops, const HandEyePoses& seed,
                            const std::optional<SizeUnknown>& size = {});

/// What is seen of a target that is so many times as large as stated.
std::vector<PoseLoop> resized(std::vector<PoseLoop> loops, double size);

}  // namespace flash::calib
