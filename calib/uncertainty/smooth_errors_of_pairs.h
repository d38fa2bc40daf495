#pragma once
#include <Eigen/Geometry>
#include <vector>

#include "calib/solve/pose_space.h"
#include "calib/uncertainty/correlated_pose_errors.h"

namespace flash::calib {

/// What errors of the arm that change smoothly with its pose may have done to the answer of pairs.
struct SmoothErrorsOfPairs {
  CorrelatedPoseErrors arm;
  Matrix6d covariance;  ///< of X, in place of what the independent scatter alone makes
  double size_sd = 0;   ///< likewise of the size of the target, where that was solved for
};

/// What independent scatter alone makes of an answer of pairs.
struct ScatterOfPairs {
  Matrix6d covariance;    ///< of X
  double size_sd = 0;     ///< of the size of the target; 0: it was not solved for
  double size_prior = 0;  ///< standard deviation of what was known of it beforehand; may be infinity
};

/// As systematic_uncertainty() has it of pictures. The scatter of a pair, of robot and camera together,
/// counts as what is independent; its levels are estimated anew beside each field. T_base_gripper: of each
/// loop. along: what the fit was made with.
SmoothErrorsOfPairs smooth_errors_of_pairs(Setup setup, const std::vector<Eigen::Isometry3d>& T_base_gripper,
                                           const std::vector<PoseLoop>& loops, const PoseSpaceFit& fit,
                                           const ScatterOfPairs& scatter,
                                           const std::optional<AlongPrior>& along = {});

}  // namespace flash::calib
