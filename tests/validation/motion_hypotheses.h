#pragma once
#include <cstddef>
#include <vector>

#include "calib/uncertainty/end_knock.h"

namespace flash::calib {

/// Camera or target moved while the views were taken, at once or at one speed.
struct MotionHypothesis {
  bool camera = false, drift = false;
  std::size_t first = 0;  ///< of a step: the place in time of the first view after it
  double evidence = 0;    ///< log of its probability over that of no motion, before either has a prior
  double size = 0;        ///< of the likeliest motion: root of turn^2 + (shift / distance)^2 [rad]
};

struct WeighedMotions {
  std::vector<MotionHypothesis> motions;
  /// The same of an arm whose errors step at a border in its poses: those nearer to one pose than others are.
  double arm = 0;
};

/// Marginal likelihoods of all steps and drifts. Views that were left out are wrong by themselves, each by 10
/// mm an axis and once in fifty, or on the short side of a step. Sizes of motions are log-uniform from 0.5 to
/// 32 mm an axis, and as much over the distance in turn. Independent errors of the arm are log-normal about
/// 0.03 deg and 0.3 mm (factor exp(1.5)), smooth ones there or not as likely, log-normal about 0.1 deg
/// (factor e).
WeighedMotions weigh_motions(const TimedPoses& poses, const BundleSettings& settings);

/// Log odds of a motion beyond `size` [rad], which has happened in one of 20 recordings: half of them steps,
/// at any time, half drifts. Smaller ones, and as often as not borders of the arm, explain the same.
double log_odds(const WeighedMotions& weighed, double size);

}  // namespace flash::calib
