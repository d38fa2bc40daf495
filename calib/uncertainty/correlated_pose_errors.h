#pragma once
#include <vector>

#include "calib/solve/errors_in_variables.h"

namespace flash::calib {

/// Errors of one arm's poses that change smoothly with the pose, as those of joints' zeros, link lengths,
/// gravity or a lens do. What they have in common over all views of a session moves camera and target alike
/// and leaves no residual: no scatter shows it, but how they change from pose to pose tells their size.
struct CorrelatedPoseErrors {
  double gain = 0;         ///< fall of -2 log restricted likelihood against errors that are independent
  bool found = false;      ///< the gain is more than chance gives once in twenty
  double translation = 0;  ///< standard deviation per axis: of the gripper's place [m],
  double rotation = 0;     ///< of its attitude, about the arm's pivot [rad],
  double about_base = 0;   ///< and of a turn of the arm about its base [rad]
  double reach = 0;        ///< length over which they agree, over the rms distance between two poses
};

/// A covariance of the shared unknowns that knows of smooth errors, for the solution as it is.
struct SystematicUncertainty {
  Eigen::MatrixXd covariance;
  std::vector<CorrelatedPoseErrors> arms;
};

/// Fits to each arm Gaussian random fields over place and attitude (Matern 5/2; Rasmussen and Williams 2006)
/// beside its independent errors, by restricted maximum likelihood, and averages over their reach with the
/// weight that each has by its likelihood. Arms whose data show no field keep what `refined` states.
SystematicUncertainty systematic_uncertainty(const Refinement& refined, const BundleSettings& settings);

}  // namespace flash::calib
