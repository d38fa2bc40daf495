#pragma once
#include <string>
#include <vector>

#include "calib/dataset/observation.h"
#include "calib/geometry/closed_form.h"
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

/// The bundle with the views of the poses whose `fold` is `part`, or of all others.
Bundle views_of(const Bundle& bundle, const std::vector<int>& fold, int part, bool inside);

/// The bundle of one camera and one arm. points: the target's, 3 x N; poses: seed.
Bundle make_bundle(Setup setup, const data::CameraIntrinsics& camera, const Eigen::Matrix3Xd& target_points,
                   const std::vector<Observation>& observations, const HandEyePoses& seed);

/// The pose that fits the pixels best, by Gauss and Newton from a pose nearby.
Eigen::Isometry3d fitted_pose(const data::CameraIntrinsics& camera, const Eigen::Matrix3Xd& points,
                              const Eigen::Matrix2Xd& pixels, Eigen::Isometry3d T_camera_target);

/// Residuals of views that took no part in the solution, predicted without a correction.
struct HeldOut {
  double px = 0;          ///< 2-D rms per corner
  double mm = 0;          ///< rms distance of the target's centre from where the view alone puts it
  double deg = 0;         ///< rms angle, likewise
  std::vector<int> fold;  ///< of each pose
};

enum class Method { park, shah, bundle, errors_in_variables };
const char* to_string(Method method);

/// Every view left out once, in `folds` interleaved parts (a pose each when there are no more than that).
/// Nothing of it stays in the solution: errors in variables estimates the noise levels anew, from those of
/// `settings`; only the pivots are kept. Parts are solved on as many threads (0: one a processor), to the
/// same digits.
HeldOut hold_out(const Bundle& bundle, const std::vector<Eigen::Isometry3d>& T_camera_target, Method method,
                 const RefineSettings& settings, int folds = 10, int threads = 1);

}  // namespace flash::calib
