#pragma once
#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "sysid/grid_results.h"
#include "sysid/summary.h"

namespace flash::sysid {

struct ProfileSettings {
  std::optional<double>
      repeatability;         ///< trial-to-trial distance of a keyframe [m]; absent: the best residual
  double confidence = 0.95;  ///< of intervals and of the region
};

/// What a grid search says about its parameters.
struct GridVerdict {
  int best = -1;             ///< index into GridResults::candidates; -1: no candidate was usable
  double score = 0;          ///< of the best [m]
  double sigma = 0;          ///< spread of a keyframe's score used [m]
  std::string sigma_source;  ///< "residual" or "repeatability"
  int keyframes = 0;         ///< sample count: keyframes that carried points, over all recordings
  double level = 0;          ///< candidates that score below are inside the confidence region [m]
  std::vector<ParameterFinding> parameters;  ///< one an axis of more than one value
};

/// Gaussian model with the keyframe, not the point, as the sample: n keyframes of score s and spread sigma. A
/// candidate's misfit rises over the best by chi^2 = n (s^2 - s_best^2) / sigma^2 with sigma =
/// max(repeatability, s_best). The profile of a parameter is the lowest score over all others at each of its
/// values; its interval is where chi^2 of the profile stays below the quantile for one degree of freedom,
/// crossings interpolated along the axis (along its logarithm where it is logarithmic); the estimate is the
/// vertex of the parabola through the best value and its neighbours. Verdict: closed on both sides "yes", on
/// neither "no", closed above only "upper_bound", below only "lower_bound".
GridVerdict profile_grid(const GridResults& results, const ProfileSettings& settings = {});

}  // namespace flash::sysid
