#pragma once
#include <string>
#include <vector>

#include "sysid/summary.h"

namespace flash::sysid {

/// What a user should do next, most useful first: the experiment that would tell each parameter that these
/// recordings do not, the range to widen, the constant to measure, or the export.
std::vector<std::string> next_steps(const Summary& summary);

/// What no search over these recordings can know, whatever its parameters: ratios to the weight where the
/// areal density is not measured, and constants that were assumed.
std::vector<std::string> standing_unknowns(const Summary& summary);

}  // namespace flash::sysid
