#pragma once
#include <optional>
#include <vector>

#include "calib/uncertainty/knock.h"

namespace flash::calib {

/// Views on the short side of a knock near an end, at most.
constexpr int kEndViews = 6;

/// A solution and, beside it, poses of views near the ends of the recording that it left out as they do not
/// fit.
struct TimedPoses {
  Refinement refined;          ///< its poses are those of the solution, then those left out
  std::vector<int> time;       ///< of each pose: its place among the views in time, from 0 on
  std::vector<char> left_out;  ///< of each pose
  std::size_t used = 0;        ///< the poses of the solution
  double shared = 0;           ///< standard deviation an axis of errors that neighbouring poses share [rad]
};

/// What is known of a knock with few views on one side of it.
struct EndKnock {
  std::optional<Knock> knock = {};         ///< where one is likelier than none; `pose` counts views in time
  bool last = false;                       ///< the few views are those after it; else those before
  std::optional<double> probability = {};  ///< that there was one; none where too few views tell
  Matrix6d covariance = Matrix6d::Zero();  ///< of X, against where the camera is at the last view, for one
                                           ///< that is not told
};

/// Looks for one step of camera or target with two to six views on one side. Two recordings are compared by
/// their likelihood with all motions integrated out: one in which nothing moved but by the errors that
/// neighbouring poses of arms in use share, and one in which those few views stand moved alike as well, by a
/// motion of 1, 3, 10 or 30 mm an axis and as much over the distance in turn. Views that were left out are
/// either wrong by themselves, each by a motion of its own and once in fifty, or moved with the others. Once
/// in twenty recordings something is knocked, at any time between two views.
EndKnock find_end_knock(const TimedPoses& poses, const BundleSettings& settings);

}  // namespace flash::calib
