#pragma once
#include "calib/uncertainty/correlated_pose_errors.h"

namespace flash::calib {

/// X and Z for which the chain predicts the pictures to the fewest pixels.
struct PixelFit {
  HandEyePoses poses;
  Matrix6d covariance = Matrix6d::Zero();  ///< of X, with the errors that poses share
  Matrix6d repeatable = Matrix6d::Zero();  ///< of X, of independent errors alone
};

/// Least squares over X and Z of one camera, at the lens, size and warp that `refined` found, robot poses as
/// reported. Its score of the pose errors xi is sum H_s^T xi (PoseInformation), so with A = sum H_ss
///     X, Z = truth - A^-1 (sum H_s^T xi + cross terms of the other unknowns) + corner noise.
/// `refined` gives the sizes of xi, `errors` what they share.
PixelFit fit_pixels(const Refinement& refined, const BundleSettings& settings, const PoseErrorModel& errors);

}  // namespace flash::calib
