#pragma once
#include <optional>
#include <string>
#include <vector>

#include "sysid/grid_results.h"

namespace flash::sysid {

/// What the searched range says about one parameter.
enum class Identifiable {
  yes,          ///< the interval closes on both sides inside the range
  no,           ///< no value of the range is excluded
  lower_bound,  ///< only small values are excluded
  upper_bound   ///< only large values are excluded
};
enum class Edge { none, low, high };

const char* name_of(Identifiable verdict);  ///< "yes", "no", "lower_bound", "upper_bound"

/// Where the spread of a keyframe's score comes from.
struct Uncertainty {
  std::optional<double>
      repeatability;  ///< trial-to-trial distance per keyframe [m]; absent: the best residual
  double confidence = 0.95;
};

/// One parameter after the search: the lowest score over all others at each of its values, and what follows.
struct ParameterProfile {
  std::string name;
  std::vector<double> values;  ///< axis values, increasing
  std::vector<double> scores;  ///< lowest score at that value [m]; infinity where no candidate was usable
  std::vector<double> chi_squared;  ///< rise of the misfit over the best candidate, in units of variance
  double estimate = 0;              ///< vertex of the parabola through the best value and its neighbours
  double low = 0, high = 0;         ///< interval at the asked confidence, cut at the searched range
  Identifiable identifiable = Identifiable::no;
  Edge edge = Edge::none;  ///< the best value is the first or last of the range
  std::string note;        ///< one sentence for a person; empty when there is nothing to say
};

struct GridVerdict {
  int best = -1;             ///< index into GridResults::candidates; -1: no candidate was usable
  double score = 0;          ///< of the best [m]
  double sigma = 0;          ///< used per keyframe [m]
  std::string sigma_source;  ///< "residual" or "repeatability"
  int keyframes = 0;         ///< sample count: keyframes that carried points, over all recordings
  std::vector<ParameterProfile> parameters;
};

/// Gaussian model with the keyframe, not the point, as the sample: with n keyframes of score s and spread
/// sigma the misfit of a candidate rises by chi^2 = n (s^2 - s_best^2) / sigma^2, sigma = max(repeatability,
/// s_best). A value belongs to the interval while the lowest chi^2 over all other parameters stays below the
/// quantile for one degree of freedom; crossings are interpolated along the axis (in its logarithm where it
/// is logarithmic).
GridVerdict profile_grid(const GridResults& results, const Uncertainty& uncertainty = {});

}  // namespace flash::sysid
