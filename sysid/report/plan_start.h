#pragma once
#include "sysid/design/plan.h"
#include "sysid/report/search_folder.h"

namespace flash::sysid {

/// What a search makes of the settings of a plan: its axes, at its estimate; what it held; and what it left
/// to be known, the covariance of its draws and the misfits of its recordings. The rest of `settings` stays.
/// The search has two draws or more and a recording.
void start_plan(const SearchFolder& search, PlanSettings& settings);

}  // namespace flash::sysid
