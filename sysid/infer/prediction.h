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
  double chance = 0;  ///< of recordings that the search expects: share that leave as many bands, or more
};

/// By what a candidate's motion differs from one on cells of no size and under finer settings, by which
/// find_answer corrects too. A recording that cannot be meshed anew is taken as it is meshed. Empty where a
/// finer motion diverges.
MotionChange correction_of(const Replay& replay, const ReplayCandidate& candidate, const MotionStore& store);

/// What a search expects of `replay`, which it has not used, beside what was observed: a posterior predictive
/// check (Rubin 1984; Gelman, Meng and Stern 1996). `motions`: of its estimate, then of draws of its
/// posterior. `correction`: by what all are off, as cells of no size would move; none where empty. `misfits`:
/// of the recordings it used, all alike likely.
///
/// An expected recording has the motion of one draw, a discrepancy of the size and the reaches of a misfit,
/// as DiscrepancyModel has it, and noise. It is registered anew, as the observed one is. The distance of a
/// keyframe is the mean over its terms of `settings.objective.robust`, on up to 200 points a term. All is to
/// first order about the estimate.
///
/// Throws data::InputError where no keyframe weighs.
Prediction predict(const Replay& replay, const std::vector<ReplayResult>& motions,
                   const MotionChange& correction, const std::vector<Misfit>& misfits,
                   const ScoreSettings& settings, unsigned seed = 1);

}  // namespace flash::sysid
