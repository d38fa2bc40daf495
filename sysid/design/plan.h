#pragma once
#include <optional>
#include <string>
#include <vector>

#include "sysid/emulate/grid_search.h"
#include "sysid/infer/discrepancy.h"
#include "sysid/replay/motion_store.h"

namespace flash::sysid {

/// What one experiment would tell of each parameter, others unknown too.
struct PlannedExperiment {
  std::string name;
  std::vector<double> spread;  ///< one standard deviation, one an axis: of its logarithm or in its unit; no
                               ///< larger than what is known without the experiment
  double bits = 0;             ///< expected information: by how many powers of two what is likely shrinks
};

/// What a search left to be known.
struct KnownSoFar {
  Eigen::MatrixXd covariance;  ///< of the searched parameters, in the coordinates of their axes
  Misfit misfit;               ///< noise and discrepancy that its recordings have
  /// Of the recordings that the misfit is of, first to last keyframe, mean [s]. The discrepancy of another
  /// recording reaches over the same share of its own, as in the prior of DiscrepancyModel; 0: over as long.
  double duration = 0;
};

struct PlanSettings {
  GridSettings grid;       ///< axes: the parameters asked for, each with the range that is thought possible
  std::vector<double> at;  ///< where the sensitivities are measured, one an axis
  double error = 1e-3;     ///< of a keyframe: the distance by which model and sheet differ [m]
  double keyframes = 10;   ///< that count as independent
  std::optional<KnownSoFar> known = {};  ///< in place of ranges, error and keyframes
};

/// Spreads from the Fisher information F = n / error^2 J^T J, J the sensitivities of what is observed with
/// registration projected out, and a prior that is the searched range (a uniform of that width): (F + P)^-1.
/// The errors of a keyframe are taken as common to it: n keyframes, not points.
///
/// With `known`, P is the inverse of its covariance and F what rows under noise and discrepancy tell
/// (expected_information), registration within its bounds and what is held without a measurement
/// (held_parameters) unknown beside the parameters; axes of one value are no parameters. An error of the
/// weight is the same in every recording and stays. Spread (in its logarithm) and bits are expected values:
/// over the parameters, by one standard deviation to both sides along the direction in which they are known
/// least; over the discrepancy of the recording to come, which is no larger than that of the search's, as
/// likely as not, or has one of its own beside it, by the prior of DiscrepancyModel. `store`: keeps the
/// motions, where there is one; then errors of the solution are reckoned with too, by finer ones.
PlannedExperiment plan_experiment(const std::string& name, const std::vector<Replay>& replays,
                                  const PlanSettings& settings, const MotionStore* store = nullptr);

/// Spread of each parameter by its range alone.
std::vector<double> spread_of_ranges(const std::vector<Axis>& axes);

/// Spread of each parameter before any experiment: by what is known, else by its range.
std::vector<double> spread_before(const PlanSettings& settings);

/// From the first to the last keyframe that counts, mean of the recordings [s].
double mean_duration(const std::vector<Replay>& replays);

/// The error to reckon with in another recording: the mean squares of noise and discrepancy, the mean
/// reaches.
Misfit expected_misfit(const std::vector<Misfit>& misfits);

}  // namespace flash::sysid
