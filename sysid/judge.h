#pragma once
#include <optional>
#include <vector>

#include "sysid/grid_search.h"
#include "sysid/summary.h"

namespace flash::sysid {

struct JudgeSettings {
  std::optional<double> repeatability;  ///< trial-to-trial distance of a keyframe [m]
  bool horizon = true;                  ///< drop keyframes beyond the predictable
  bool solver_check = true;             ///< solve the best candidate again under finer settings
};

/// From the results of a search to its answer: measures how long the best candidate's motion can be predicted
/// and takes the weight from later keyframes (in `results` and `replays`), solves the estimate under finer
/// settings, lets what these shift widen the intervals, and sums up.
Summary judge(GridResults& results, std::vector<Replay>& replays, const GridSettings& grid,
              const JudgeSettings& settings);

}  // namespace flash::sysid
