#pragma once
#include <Eigen/Core>
#include <vector>

#include "calib/solve/errors_in_variables.h"
#include "calib/solve/linearization.h"

namespace flash::calib {

/// By how much views disagree beyond the noise that each of them has by itself, as one after the other is
/// left out (data::jackknife_factor): factors of variances, at least 1.
///
/// Corners of one view share errors that no corner shows: of the print, of light and blur, of the lens's
/// model. That of the lens is of all cameras' lenses, and of warps and edges beside them, by each view with
/// its pose free: the robot has no say in it. 1 where the lens is no unknown.
double lens_disagreement(const Refinement& refined, const BundleSettings& settings);

/// That of the first camera's place, by each robot pose with its correction held by the robot's noise.
double camera_disagreement(const Refinement& refined, const BundleSettings& settings);

/// The covariance of all shared unknowns where lenses, warps and edges have a `factor` times as large one,
/// and all else follows them as it does:
///     C + (factor - 1) C(:, l) C(l, l)^-1 C(l, :).
Eigen::MatrixXd with_lens_raised(const Eigen::MatrixXd& covariance, const SharedColumns& columns,
                                 double factor);

}  // namespace flash::calib
