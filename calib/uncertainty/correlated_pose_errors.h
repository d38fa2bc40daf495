#pragma once
#include <Eigen/Core>
#include <vector>

#include "calib/solve/errors_in_variables.h"
#include "calib/uncertainty/pose_error_modes.h"
#include "calib/uncertainty/pose_information.h"

namespace flash::calib {

/// Errors of one arm's poses that change smoothly with the pose, as those of joints' zeros, link lengths,
/// gravity or a lens do. What they have in common over all views of a session moves camera and target alike
/// and leaves no residual: no scatter shows it, but how they change from pose to pose tells their size.
struct CorrelatedPoseErrors {
  double gain = 0;         ///< fall of -2 log restricted likelihood against errors that are independent
  bool found = false;      ///< the gain is more than chance gives once in twenty
  double share = 0;        ///< probability that there are any
  double rotation = 0;     ///< standard deviation per axis of turns at the wrist and about the base [rad],
  double translation = 0;  ///< and of shifts [m]
  double reach = 0;        ///< over which they agree [rad], see squared_distances
};

/// Errors of the poses of each arm: a mean over all that was tried, by its probability.
struct PoseErrorModel {
  std::vector<CorrelatedPoseErrors> arms;
  std::vector<std::vector<std::size_t>> poses;  ///< of each arm, those that were seen
  /// Of their errors (base axes, at the gripper), six a pose, times `share`; empty: no pose was seen.
  std::vector<Eigen::MatrixXd> covariance;
};

/// Of one arm, from what its poses' errors are seen to be. prior: of the shared unknowns. noise: variances an
/// axis of errors that are independent, of translation and of rotation, in units of the modes' columns.
struct ArmErrorFit {
  CorrelatedPoseErrors errors;
  Eigen::MatrixXd covariance;  ///< of all poses, as PoseErrorModel's
};
ArmErrorFit fit_arm_errors(const std::vector<PoseModes>& modes, const std::vector<PoseInformation>& seen,
                           const Eigen::MatrixXd& prior, const Eigen::Vector2d& noise);

/// Beside the independent errors of each arm stand Gaussian random fields over place and attitude (Matern
/// 5/2; Rasmussen and Williams 2006) of one size, in all ways in which a wrong kinematic model moves a
/// gripper: it is turned at the wrist, turned about the base, shifted in either's axes, and the arm is
/// stretched. Each size and reach has the weight of its restricted likelihood times what it has among arms in
/// use: sizes log-normal about 0.1 deg, reaches as errors of zeros, links, axes and gears have them.
/// Where the zeros of joints are unknowns, they stand for all that.
PoseErrorModel fit_pose_errors(const Refinement& refined, const BundleSettings& settings);

}  // namespace flash::calib
