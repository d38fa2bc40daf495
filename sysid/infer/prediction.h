#pragma once
#include <array>
#include <vector>

#include "sysid/emulate/grid_search.h"
#include "sysid/infer/discrepancy.h"
#include "sysid/infer/motion_change.h"
#include "sysid/observe/registration.h"
#include "sysid/replay/motion_store.h"

namespace flash::sysid {

/// A keyframe of a recording that no search has used, and what was to be expected of it.
struct PredictedKeyframe {
  double t = 0;                  ///< [s]
  double distance = 0;           ///< mean, of what was observed from the predicted surface [m]
  std::array<double, 2> band{};  ///< 95 % of the distances that the search expects [m]

  bool holds() const { return band[0] <= distance && distance <= band[1]; }
};

struct Prediction {
  RegistrationFit fit;                       ///< of the estimate's motion to the recording
  std::vector<PredictedKeyframe> keyframes;  ///< those that weigh
  double chance = 0;  ///< share of the recordings that the search expects which are as far from their mean
};

/// How the answer that is to predict was solved.
struct SolvedAs {
  bool no_cells = false;  ///< on cells of no size, extrapolated
  bool checked = false;   ///< beside finer settings of the solver
};

/// Errors of known shape that a search's likelihood has, about `values` in a recording that it has not used:
/// what it holds without a measurement, the step to cells of no size, finer settings. `own`: the motion at
/// `values`. What diverges is left out.
std::vector<KnownError> errors_of_prediction(const Replay& replay, const GridSettings& grid,
                                             const std::vector<double>& values, const ReplayResult& own,
                                             const SolvedAs& solved, const MotionStore& store);

/// What a search expects of `replay`, which it has not used, beside what was observed: a posterior predictive
/// check (Rubin 1984; Gelman, Meng and Stern 1996). `motions`: of its estimate, then of draws of its
/// posterior. `misfits`: of the recordings it used, all alike likely.
///
/// An expected recording has the motion of one draw, the errors of known shape under their prior, a
/// discrepancy of the size and the reaches that one misfit makes likely, as DiscrepancyModel has it, what is
/// rough in that misfit, and noise as large as that between neighbours of the recording itself. Registration
/// and errors of known shape are fitted to it, as to the observed one (MotionLikelihood). The distance of a
/// keyframe is the mean over its terms of `settings.objective.robust`. All but the fit of what was observed
/// is to first order about the estimate. How far a recording is from what is expected is Mahalanobis'
/// distance of the logarithms.
///
/// Throws data::InputError where no keyframe weighs.
Prediction predict(const Replay& replay, const std::vector<ReplayResult>& motions,
                   const std::vector<KnownError>& errors, const std::vector<Misfit>& misfits,
                   const ScoreSettings& settings, unsigned seed = 1);

}  // namespace flash::sysid
