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

/// Of each of `count` views the part in which it is left out: interleaved, or drawn at random by a seed above
/// 0.
std::vector<int> parts_of(int count, int folds, unsigned seed);

/// Mean of the squares over the poses of each fold. measure: 0 px, 1 mm, 2 deg.
std::vector<double> means_of_folds(const HeldOut& held, int measure);

/// The mean of paired differences and its standard error.
struct MeanDifference {
  double mean = 0, sd = 0;
};
MeanDifference mean_difference(const std::vector<double>& a, const std::vector<double>& b);

enum class Method {
  park,
  shah,
  bundle,  ///< the fewest pixels at the lens that the bundle holds, robot exact
  pixels,  ///< the same at the lens, size and warp that errors in variables finds
  errors_in_variables
};
const char* to_string(Method method);

/// Every view left out once, in `folds` parts (a pose each when there are no more than that): parts_of().
/// Nothing of it stays in the solution: errors in variables estimates the noise levels anew, from those of
/// `settings`; only the pivots are kept. Parts are solved on as many threads (0: one a processor), to the
/// same digits.
HeldOut hold_out(const Bundle& bundle, const std::vector<Eigen::Isometry3d>& T_camera_target, Method method,
                 const RefineSettings& settings, int folds = 10, int threads = 1, unsigned seed = 0);

/// Two halves of the views taken for two arms on one camera, again and again.
struct Halves {
  std::vector<std::vector<int>> first;  ///< poses of one half of each split
  std::vector<double> apart;            ///< how far they put the middle of the workspace from each other [mm]
  double rms() const;
};

/// `splits` drawn at random, the same for every method. middle: of the workspace, in the parent of X.
Halves halves_apart(const Bundle& bundle, const std::vector<Eigen::Isometry3d>& T_camera_target,
                    Method method, const RefineSettings& settings, const Eigen::Vector3d& middle,
                    int splits = 10, int threads = 1);

}  // namespace flash::calib
