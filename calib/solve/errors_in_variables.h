#pragma once
#include <Eigen/Core>

#include "calib/solve/bundle_adjustment.h"

namespace flash::calib {

struct RefineSettings {
  bool estimate_noise = true;  ///< from the data, by variance components; otherwise `noise` stands
  NoiseLevels noise;           ///< start, or the truth; empty: 0.5 px, 3 mrad, 3 mm, 3 mm of depth
  BundleSettings bundle;
  bool estimate_pivots = true;  ///< where along the way from gripper to target rotation and translation
                                ///< errors are independent; the frame a robot reports need not be that place
  int rounds = 15;              ///< of bundle and variance components in turn
  double tolerance = 1e-3;      ///< stop when new noise levels would lower the deviance by less than this
};

struct Refinement {
  Bundle bundle;
  NoiseLevels noise;
  Eigen::MatrixXd covariance;    ///< of the shared unknowns (SharedColumns), corrections marginalised
  Eigen::VectorXd noise_log_sd;  ///< standard deviation of the log of each noise level, as to_components
  int rounds = 0;
  bool converged = false;
};

/// The same level for all cameras and arms.
NoiseLevels uniform_noise(const Bundle& bundle, double corner, double rotation, double translation,
                          double depth);

/// Errors in variables: the bundle with a correction of every robot pose, and the noise of corners, robot
/// rotation and robot translation estimated from the same data by restricted maximum likelihood. The
/// covariance is the inverse of the information that is left for the shared unknowns.
Refinement refine(Bundle bundle, const RefineSettings& settings = {});

}  // namespace flash::calib
