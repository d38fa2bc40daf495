#pragma once
#include <Eigen/Geometry>
#include <vector>

#include "calib/solve/pose_space.h"
#include "calib/uncertainty/correlated_pose_errors.h"

namespace flash::calib {

/// What errors of the arm that change smoothly with its pose may have done to the answer of pairs.
struct SmoothErrorsOfPairs {
  CorrelatedPoseErrors arm;
  Matrix6d covariance;     ///< of X, in place of what the independent scatter alone makes
  Eigen::Matrix2d scales;  ///< likewise of the logs of SeenScales, where they were solved for
};

/// What independent scatter alone makes of an answer of pairs.
struct ScatterOfPairs {
  Matrix6d covariance;     ///< of X
  Eigen::Matrix2d scales;  ///< of the logs of SeenScales; 0: one that was not solved for
  Eigen::Vector2d known;   ///< information of what was known of them beforehand
};

/// As systematic_uncertainty() has it of pictures. The scatter of a pair, of robot and camera together,
/// counts as what is independent; its levels are estimated anew beside each field. T_base_gripper: of each
/// loop. along: what the fit was made with.
SmoothErrorsOfPairs smooth_errors_of_pairs(Setup setup, const std::vector<Eigen::Isometry3d>& T_base_gripper,
                                           const std::vector<PoseLoop>& loops, const PoseSpaceFit& fit,
                                           const ScatterOfPairs& scatter,
                                           const std::optional<AlongPrior>& along = {});

}  // namespace flash::calib
