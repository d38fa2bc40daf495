#pragma once
#include <Eigen/Core>
#include <vector>

#include "calib/uncertainty/correlated_pose_errors.h"

namespace flash::calib {

/// The covariance of the shared unknowns under errors of the poses that they share, for the solution as it
/// is.
struct SystematicUncertainty {
  Eigen::MatrixXd covariance;
  std::vector<CorrelatedPoseErrors> arms;
  std::vector<double> caution;  ///< of each target's size: what Priors::caution wants
};

/// In place of the independent errors that the solution was made with stand, by their share, those of
/// `model`; priors count for what they are, whatever they weigh in the solution.
SystematicUncertainty systematic_uncertainty(const Refinement& refined, const BundleSettings& settings,
                                             const PoseErrorModel& model);

}  // namespace flash::calib
