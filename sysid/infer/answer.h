#pragma once
#include <optional>
#include <vector>

#include "sysid/emulate/grid_search.h"
#include "sysid/infer/answer_work.h"
#include "sysid/infer/profile.h"
#include "sysid/infer/solver_check.h"

namespace flash::sysid {

struct AnswerSettings {
  std::optional<double> repeatability;  ///< trial-to-trial distance of a keyframe [m]
  bool horizon = true;                  ///< drop keyframes beyond the predictable
  bool solver_check = true;             ///< solve the best candidate again under finer settings
};

/// What a search says of its parameters, and how that was checked.
struct Answer {
  GridVerdict verdict;
  std::vector<SolverCheck> checks;  ///< of the estimate; empty without them
  double interpolation = 0;         ///< by which the interpolated score is off at the estimate [m]
  std::vector<std::optional<double>> horizons;  ///< of each recording [s]
};

/// From the results of a search to its answer: measures how long the best candidate's motion can be predicted
/// and takes the weight from later keyframes (in `results` and `replays`), solves the estimate under finer
/// settings, and lets what these shift widen the intervals. `told`: where motions were kept, of the work that
/// most_work counts.
Answer find_answer(GridResults& results, std::vector<Replay>& replays, const GridSettings& grid,
                   const AnswerSettings& settings, const TellWork& told = {});

}  // namespace flash::sysid
