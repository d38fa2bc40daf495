#pragma once
#include <optional>
#include <string>
#include <vector>

#include "sysid/emulate/grid_search.h"
#include "sysid/infer/answer.h"
#include "sysid/replay/replay.h"
#include "sysid/report/summary.h"

namespace flash::sysid {

/// What a search found, said for people and for later tools: estimates, intervals, nuisance values, what was
/// fixed, whether the model fits, warnings, and whether the answer can be used. Scores, registration and
/// residuals are those of the estimate on the mesh that the answer is of (Answer::fit). exit_code is 3 when
/// no candidate has a score, when the estimate did not converge, or when none of the searched material
/// parameters is identifiable; `warnings` then begins with the reason. Device and times are left to the
/// caller.
Summary summarize(const GridResults& results, const Answer& answer, const std::vector<Replay>& replays,
                  const GridSettings& grid, const AnswerSettings& settings = {});

}  // namespace flash::sysid
