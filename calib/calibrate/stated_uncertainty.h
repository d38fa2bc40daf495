#pragma once
#include <Eigen/Eigenvalues>

#include "calib/calibrate/calibrate.h"

namespace flash::calib {

/// The covariances that a solution states, `repeatable` of what scatters and `covariance` of all: noise, what
/// views disagree on about the lens, and what errors that change smoothly with the robot's pose share.
/// Returns by how much these have raised the variances.
double add_uncertainty(Calibration& result, const SystematicUncertainty& systematic,
                       const BundleSettings& settings);

/// By how much the variances of `more` are larger than those of `less`, in the mean over their directions.
double growth(const Matrix6d& less, const Matrix6d& more);

/// Adds what `least` has beyond `covariance`, direction by direction.
template <int n>
void raise_to(const Eigen::Matrix<double, n, n>& least, Eigen::Matrix<double, n, n>& covariance) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, n, n>> missing(least - covariance);
  covariance += missing.eigenvectors() * missing.eigenvalues().cwiseMax(0.0).asDiagonal() *
                missing.eigenvectors().transpose();
}

/// That errors which are found to change smoothly have raised the variances by `grown`.
void tell_smooth_errors(Calibration& result, double grown);

/// Raises both by as much as parts of the recording disagree beyond that: its views one by one, and halves of
/// them, which are told. Parts of few views determine too little by themselves. smooth: what add_uncertainty
/// returned; it is told where it raises the deviations by half beyond what parts show.
void check_parts(Calibration& result, double smooth, const BundleSettings& settings,
                 const CalibrateSettings& calibrate);

}  // namespace flash::calib
