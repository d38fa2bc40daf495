#pragma once
#include <Eigen/Geometry>
#include <vector>

#include "calib/solve/errors_in_variables.h"

namespace flash::calib {

/// Residuals of views that took no part in the solution, predicted without a correction.
struct HeldOut {
  double px = 0;          ///< 2-D rms per corner
  double mm = 0;          ///< rms distance of the target's centre from where the view alone puts it
  double deg = 0;         ///< rms angle, likewise
  std::vector<int> fold;  ///< of each pose
  /// Of px (mean over the corners), mm and deg of each pose, of solutions from pictures; else empty.
  std::vector<Eigen::Vector3d> squares;
};

/// Mean of the squares over the poses of each fold. measure: 0 px, 1 mm, 2 deg.
std::vector<double> means_of_folds(const HeldOut& held, int measure);

/// The mean of paired differences and its standard error.
struct MeanDifference {
  double mean = 0, sd = 0;
};
MeanDifference mean_difference(const std::vector<double>& a, const std::vector<double>& b);

enum class Method { park, shah, bundle, errors_in_variables };
const char* to_string(Method method);

/// Every view left out once, in `folds` interleaved parts (a pose each when there are no more than that).
/// Nothing of it stays in the solution: errors in variables estimates the noise levels anew, from those of
/// `settings`; only the pivots are kept. Parts are solved on as many threads (0: one a processor), to the
/// same digits.
HeldOut hold_out(const Bundle& bundle, const std::vector<Eigen::Isometry3d>& T_camera_target, Method method,
                 const RefineSettings& settings, int folds = 10, int threads = 1);

}  // namespace flash::calib
