#pragma once
#include <Eigen/Geometry>
#include <optional>
#include <vector>

#include "calib/geometry/closed_form.h"
#include "calib/geometry/pose.h"

namespace flash::calib {

/// The camera or the target moved at once, between two pairs of poses.
struct StepOfPairs {
  std::size_t first = 0;  ///< pair since the motion
  bool of_target = false;
  Vector6d motion = Vector6d::Zero();  ///< of X, or of the target's Z, right perturbation (dt, dtheta)
  double distance =
      0;            ///< of places or of turns, over the scatter of one pair (rms an axis): the larger of both
  double gain = 0;  ///< fall of -2 log likelihood, less what its unknowns cost
};

/// What each pair by itself makes of X, beside `poses`, is taken as normal about one mean, or about one
/// before a pair and another since, with one covariance (Hotelling 1931). Pairs of one pose of the robot, one
/// after the other, count as one. A step costs log n an unknown (Schwarz 1978). It has to gain 20, and more
/// than all but two of a hundred other orders of the pairs do; and the medians have to move by half as far as
/// the means, which outliers alone can move.
/// Likewise of Z: of the two the likelier. Empty where nothing moved, and of fewer than ten pairs, which do
/// not tell a covariance.
std::optional<StepOfPairs> step_of_pairs(const std::vector<PoseLoop>& loops, const HandEyePoses& poses);

}  // namespace flash::calib
