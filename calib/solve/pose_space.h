#pragma once
#include <Eigen/Core>
#include <limits>
#include <optional>
#include <vector>

#include "calib/geometry/closed_form.h"
#include "calib/geometry/pose.h"
#include "calib/solve/along_prior.h"

namespace flash::calib {

/// Noise of places per axis, robot and camera together, about the camera's line of sight to the target [m].
struct SightNoise {
  double across = 0, along = 0;

  double rms() const;  ///< over all three axes
};

/// What the poses of a target were made with, true over stated. A larger target is as many times as far away,
/// a longer focal length puts it as many times as far along the camera's axis: what lies across that keeps
/// its place.
struct SeenScales {
  double size = 1, focal_length = 1;

  Eigen::Vector2d logs() const;
};

/// X and Z where there are poses of the target, but no corners.
struct PoseSpaceFit {
  HandEyePoses poses;
  Eigen::MatrixXd covariance;  ///< of (X, Z), right perturbations (dt, dtheta), and the logs of the scales
                               ///< where these are unknowns; one that is as stated has none
  SeenScales scales;
  double rotation = 0;  ///< noise of the closed chain per axis, robot and camera together [rad]
  SightNoise translation;
  bool converged = false;
};

/// Scales as unknowns, each with the standard deviation of what it is off by; 0: it is as stated, infinity:
/// nothing is known. What is known has the long tail of LensPrior.
struct ScalesUnknown {
  double size_sd = std::numeric_limits<double>::infinity();
  double focal_length_sd = 0;
  /// How much of the noise of places across the line of sight is the camera's; what there is more of along it
  /// is all the camera's. Noise makes lengths look larger than they are: a robot's noise the target too
  /// large, a camera's too small. Pairs do not tell whose it is.
  double camera_share = 0.5;
};

/// Minimises the sum over views of |dt - s s^T dt|^2 / across^2 + |s^T dt|^2 / along^2 + |dtheta|^2 /
/// rotation^2, (dt, dtheta) the motion between the target as predicted, X^-1 G^-1 Z, and as seen, C; s the
/// line of sight from the camera to the target as seen, in the frame of dt. A camera tells a distance worse
/// than what lies across. The three noise levels are of restricted maximum likelihood, the ratio of the last
/// two with a prior that few pairs feel. A target at the camera's origin has no line of sight: all of its dt
/// counts as across. Gauss and Newton. scales: of size and focal length; none: both are as stated. along:
/// what is known of a place beforehand; none: nothing.
PoseSpaceFit fit_pose_space(const std::vector<PoseLoop>& loops, const HandEyePoses& seed,
                            const std::optional<ScalesUnknown>& scales = {},
                            const std::optional<AlongPrior>& along = {});

/// How far a pair is from closing, (dt, dtheta) as fit_pose_space() has them, and its derivatives.
struct LinearLoop {
  Vector6d residual;
  Eigen::Matrix<double, 6, 12> by_poses;  ///< X, then Z, right perturbations
  Matrix6d by_predicted;                  ///< the target's predicted pose, likewise
  Eigen::Matrix<double, 6, 2> by_scales;  ///< the logs of SeenScales, where the noise is the robot's
  Eigen::Vector3d sight;                  ///< unit, along the line of sight; zero where there is none
  Eigen::Vector3d axis;                   ///< unit, of the camera
};
LinearLoop linear_loop(const PoseLoop& loop, const HandEyePoses& poses);

/// What is seen with other scales than the stated ones.
Eigen::Isometry3d rescaled(Eigen::Isometry3d T_camera_target, const SeenScales& scales);
std::vector<PoseLoop> rescaled(std::vector<PoseLoop> loops, const SeenScales& scales);

}  // namespace flash::calib
