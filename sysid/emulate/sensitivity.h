#pragma once
#include <Eigen/Core>
#include <functional>
#include <vector>

#include "sysid/emulate/grid_search.h"
#include "sysid/observe/linear_observations.h"

namespace flash::sysid {

/// How what is observed moves with the parameters, to first order, at one set of values. Rows: those of
/// `places`, recording after recording, divided by the root of their number, so that a sum of squares is the
/// mean over recordings.
struct Sensitivity {
  std::vector<ReplayResult> motions;       ///< at the values themselves, one a recording
  std::vector<LinearObservations> places;  ///< one a recording
  Eigen::MatrixXd parameters;  ///< columns: the searched axes; a row's change by the logarithm of a
                               ///< logarithmic axis, else by its unit [m]
  Eigen::MatrixXd nuisance;    ///< columns: offset, yaw and time of each recording that have room, per half
                               ///< width of their bounds [m]
};

/// The motions of recording r at several sets of values, each one an axis.
using MotionsAt =
    std::function<std::vector<ReplayResult>(std::size_t r, const std::vector<std::vector<double>>& values)>;

/// Central differences over one batch of environments a recording, one-sided at the end of a parameter's
/// range: two rollouts a parameter and one at the values. `values`: one an axis of `grid.axes`; places are
/// those of the registration fitted there. Without `differentiate` the motions and places alone; the columns
/// are zero. `motions`: where they come from; without one they are simulated.
Sensitivity measure_sensitivity(const std::vector<Replay>& replays, const GridSettings& grid,
                                const std::vector<double>& values, bool differentiate = true,
                                const MotionsAt& motions = {});

/// By how much each keyframe tells the parameters: J^T J over its rows, what the registration explains taken
/// out of J, for the weighing keyframes, recording after recording [m^2].
std::vector<Eigen::MatrixXd> keyframe_information(const Sensitivity& sensitivity);

/// Displacements of the places towards other motions, in rows as above. `replays` may differ in mesh and step
/// from those of the sensitivity, not in their keyframes.
Eigen::VectorXd displacements(const Sensitivity& sensitivity, const std::vector<Replay>& replays,
                              const std::vector<ReplayResult>& motions);

/// The change of the parameters that comes nearest to given displacements in least squares, nuisance fitted
/// beside it, both held near zero by a floor of a micrometre over their ranges. `ranges`: of the parameters,
/// in the units of the columns; no change is larger.
Eigen::VectorXd explain(const Sensitivity& sensitivity, const Eigen::VectorXd& displacement,
                        const Eigen::VectorXd& ranges);

}  // namespace flash::sysid
