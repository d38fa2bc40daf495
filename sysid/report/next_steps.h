#pragma once
#include <string>
#include <vector>

#include "sysid/report/summary.h"

namespace flash::sysid {

/// What a user should do next, most useful first: the experiment that would tell each parameter that these
/// recordings do not, the range to widen, the constant to measure, or the export.
std::vector<std::string> next_steps(const Summary& summary);

/// What this search over these recordings cannot know, whatever its parameters: ratios to the weight where
/// the areal density is not measured, constants that were assumed, and checks that were left out.
std::vector<std::string> standing_unknowns(const Summary& summary);

}  // namespace flash::sysid
