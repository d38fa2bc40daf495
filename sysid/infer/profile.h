#pragma once
#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "sysid/emulate/results_store.h"
#include "sysid/infer/finding.h"

namespace flash::sysid {

/// What a grid search says about its parameters.
struct GridVerdict {
  int best = -1;              ///< index into GridResults::candidates; -1: no candidate was usable
  double score = 0;           ///< of the best [m]
  Eigen::VectorXd estimate;   ///< where the interpolated score is least, one value an axis
  double estimate_score = 0;  ///< interpolated, there [m]
  double sigma = 0;           ///< spread of a keyframe's score that the region comes to [m]
  std::string sigma_source;   ///< "residual" or "repeatability"
  int keyframes = 0;          ///< sample count: keyframes that weighed, over all recordings
  double level95 = 0;         ///< candidates that score below are inside the joint 95 % region [m]
  std::vector<ParameterFinding> parameters;  ///< one an axis, in order
  Eigen::MatrixXd
      covariance_log;  ///< of log(parameter), in order of the axes; empty where the region gives none
};

/// How far a better solution moves the estimate, one an axis: along the logarithm of a logarithmic axis, else
/// in the parameter's unit. The search's own settings at estimate + shift move as the better ones at the
/// estimate.
using SolverShift = Eigen::VectorXd;

/// What finer solutions say of the search's own.
struct SolverError {
  std::vector<SolverShift> shifts{};
  double score = 0;          ///< by which the displacement between two solutions raises a score [m]
  double interpolation = 0;  ///< by which the interpolated score is off at the estimate [m]
  std::vector<SolverShift> remainders{};  ///< of which the size is known, not the sign
};

/// The profile of one parameter at an end of its range, where the grid judged is a part of it.
struct RangeEnd {
  std::size_t axis = 0;
  double score = 0;          ///< least over the other parameters [m]
  Eigen::VectorXd estimate;  ///< where it is least, one value an axis
};

/// How a grid is judged.
struct ProfileSettings {
  std::optional<double> repeatability;  ///< trial-to-trial distance of a keyframe [m]
  SolverError solver;
  std::vector<Eigen::MatrixXd> information{};  ///< of each weighing keyframe (keyframe_information); empty:
                                               ///< all count alike
  std::vector<RangeEnd> ends{};                ///< of the ranges that the grid does not cover
};

/// Profile likelihood with the keyframe, not the point, as the sample. The score is interpolated between the
/// points of the grid (ScoreInterpolant), so that nothing below depends on where these stand.
///
/// The profile of a parameter is the lowest score over all others at each of its values. How sure a
/// difference of scores is, the keyframes tell: with d_k the difference of keyframe k between a point of the
/// profile and the estimate, and D their weighted mean, a point stays inside while
///
///     chi^2 = 4 D^2 / var(D) < t^2,     var(D) = sum_r n_r / (n_r - 1) sum_k w_k^2 (d_k - d_r)^2
///
/// t being Student's 97.5 % quantile at n - p degrees of freedom, d_r the mean over recording r. For a
/// quadratic score this is the interval of the robust (sandwich) covariance H^-1 J H^-1 / n (White 1982); the
/// factor 4 is there because D is half the squared distance while its spread is linear in it. With
/// `information`, an estimate at the end of the searched range need not be a minimum: D = G + Q there, Q by
/// its curvature, and the same likelihood ratio is chi^2 = 4 D Q / var(D); Q counting as D / 20 at least.
/// Where several recordings contradict each other beyond their keyframes' scatter, var(D) grows by their
/// Birge ratio. `repeatability`, the trial-to-trial distance of a keyframe [m], caps chi^2 at n (s^2 -
/// s_best^2) / repeatability^2.
///
/// The interpolation is checked where it matters: D counts only by what it exceeds its error at the estimate.
/// `information` says how unequally keyframes tell a parameter; var(D) and t are then those of
/// cluster_variance. Each shift widens the interval to the side on which the better solution would have found
/// the parameter, each remainder to both, in quadrature. A side on which the profile nowhere rises by more
/// than these errors excludes nothing. An interval holds what the profiles of the other parameters do not
/// exclude. Verdict: excluded values on both sides "yes", on neither "no", only above "upper_bound", only
/// below "lower_bound".
GridVerdict profile_grid(const GridResults& results, const ProfileSettings& settings);
GridVerdict profile_grid(const GridResults& results, std::optional<double> repeatability = {},
                         const SolverError& solver = {});

}  // namespace flash::sysid
