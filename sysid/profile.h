#pragma once
#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "sysid/grid_results.h"
#include "sysid/summary.h"

namespace flash::sysid {

/// What a grid search says about its parameters.
struct GridVerdict {
  int best = -1;             ///< index into GridResults::candidates; -1: no candidate was usable
  double score = 0;          ///< of the best [m]
  double sigma = 0;          ///< spread of a keyframe's score used [m]
  std::string sigma_source;  ///< "residual" or "repeatability"
  int keyframes = 0;         ///< sample count: keyframes that weighed, over all recordings
  double score_error = 0;    ///< what a score is known to [m]
  double level95 = 0;        ///< candidates that score below are inside the joint 95 % region [m]
  std::vector<ParameterFinding> parameters;  ///< one an axis, in order
  Eigen::MatrixXd
      covariance_log;  ///< of log(parameter), in order of the axes; empty where the region gives none
};

/// Gaussian model with the keyframe, not the point, as the sample: n keyframes of score s and spread sigma =
/// max(repeatability, s_best). A candidate's misfit rises over the best by chi^2 = n (s^2 - s_best^2) /
/// sigma^2. `repeatability`: trial-to-trial distance of a keyframe [m]; absent: the best residual stands for
/// it. `score_error`: how far finer solver settings move a score [m]; candidates count as better by as much
/// before they are excluded.
///
/// The profile of a parameter is the lowest score over all others at each of its values. Its 95 % interval is
/// where chi^2 of the profile stays below 3.84, crossings interpolated along the axis (along its logarithm
/// where it is logarithmic) and cut at the searched range. The estimate is the vertex of the parabola through
/// the best value and its neighbours. Verdict: excluded values on both sides "yes", on neither "no", only
/// above "upper_bound", only below "lower_bound".
///
/// The covariance is that of the paraboloid fitted to chi^2 over the candidates within chi^2 < 12 of the
/// best; empty where an axis is not positive, there are too few candidates, or the paraboloid is not convex.
GridVerdict profile_grid(const GridResults& results, std::optional<double> repeatability = {},
                         double score_error = 0);

}  // namespace flash::sysid
