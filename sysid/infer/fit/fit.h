#pragma once
#include <functional>
#include <vector>

#include "sysid/emulate/grid_search.h"
#include "sysid/infer/fit/global_search.h"
#include "sysid/infer/fit/prior.h"

namespace flash::sysid {

struct FitSettings {
  GridSettings grid;  ///< axes: the parameters fitted, with the range each may take; fixed ones as there
  std::vector<double> start;  ///< one an axis
  std::vector<Prior> priors;
  GlobalSearchSettings global;  ///< before Levenberg-Marquardt, over the axes' ranges
  int iterations = 15;          ///< of Levenberg-Marquardt at most
  double tolerance = 1e-4;      ///< stops when a step gains less than this share of the cost
};

enum class FitStage { global, local };

/// One iterate, or the best candidate of a generation of the global search.
struct FitStep {
  std::vector<double> values;  ///< one an axis
  double cost = 0;             ///< chi^2 / 2, priors included; comparable within a stage
  bool accepted = true;        ///< otherwise tried and left; of a generation: better than all before
  FitStage stage = FitStage::local;
};

struct FitResult {
  std::vector<double> values;  ///< one an axis
  CandidateResult best;        ///< scored there; values as above
  Eigen::MatrixXd covariance;  ///< of the axes' coordinates; empty where a direction is not determined
  std::vector<FitStep> path;   ///< in order
  bool refined = true;         ///< false: no step was taken from the start of Levenberg-Marquardt,
  bool stuck = false;          ///< though it is no minimum: it is at the end of a range, or motions diverge
  std::string termination;     ///< in words: why it ended, and which values stand at the end of their range
};

/// Levenberg-Marquardt (Ceres, trust region, box) over the logarithms of logarithmic axes, from `start` or
/// from the best of a global search of the same cost, each generation one batch of environments, on the
/// signed distances of what was observed (LinearObservations), thinned, registration fitted at every point
/// and projected out of the derivatives (variable projection, Kaufman 1975). Large distances count by their
/// size, not their square, from the median of those at the stage's start. Derivatives are finite differences,
/// all parameters in one batch of environments. With sigma^2 the mean square there and n keyframes the cost
/// is n / 2 mean square / sigma^2 plus half the squared deviations from the priors. `report` is called after
/// each step. Throws data::InputError where the simulation diverges at `start`, and data::Stopped where the
/// replays' solver settings ask for it.
FitResult fit(const std::vector<Replay>& replays, const FitSettings& settings,
              const std::function<void(const FitStep&)>& report = {});

}  // namespace flash::sysid
