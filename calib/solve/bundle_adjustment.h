#pragma once
#include <vector>

#include "calib/solve/bundle.h"

namespace flash::calib {

/// Standard deviations per axis, of every camera or arm.
struct NoiseLevels {
  std::vector<double> corner;       ///< of a corner, per camera [px]
  std::vector<double> rotation;     ///< of a robot pose, per arm [rad]
  std::vector<double> translation;  ///< of a robot pose, per arm [m]
  std::vector<double> depth;        ///< of a depth, per camera [m]
};

/// What may change. The first arm's base never does.
struct Unknowns {
  bool corrections = true;    ///< of robot poses, held by a prior of their noise: errors in variables
  int intrinsics = 0;         ///< how many of fx fy cx cy k1 k2 p1 p2 k3 ..., held by Priors::lenses
  bool scales = false;        ///< of targets, held by Priors::scale_sd
  bool warps = false;         ///< of targets, held by Priors::warp_sd
  bool edge_offsets = false;  ///< of cameras that see corners of edges, held by kUsualEdgeOffset
  bool joint_errors =
      false;  ///< of arms whose joints are known, held by Bundle::joint_error_sd; with corrections
  bool time_offsets = false;
  bool depth_scales = true;  ///< of cameras with depth: it tells shape and tilt, not how long a metre is
};

struct BundleSettings {
  Unknowns unknowns;
  double huber = 3.5;  ///< of a corner's residual, in its standard deviations; 0: squares throughout
  int iterations = 100;
  double tolerance = 1e-10;  ///< relative change of the cost
};

struct BundleSummary {
  double cost = 0;  ///< half the sum of squares over their variances
  int iterations = 0;
  bool converged = false;
};

/// Minimises the sum over all corners of rho(|pixel - project(q)|^2 / corner^2) and, with corrections D, the
/// prior |dt|^2 / translation^2 + |dtheta|^2 / rotation^2 of each, dt being the motion of the arm's pivot,
/// from what the errors of its joints make of it. Levenberg-Marquardt on the manifold; the corrections are
/// eliminated first.
BundleSummary solve_bundle(Bundle& bundle, const NoiseLevels& noise, const BundleSettings& settings = {});

}  // namespace flash::calib
