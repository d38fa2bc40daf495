#pragma once
#include <string>
#include <vector>

#include "sysid/report/summary.h"

namespace flash::sysid {

/// What a user should do next: the range to widen, the experiment that is expected to tell most, and those
/// that tell best what it does not (Summary::next_experiments), what warnings name, and last the export;
/// where to look where there is nothing of these.
std::vector<std::string> next_steps(const Summary& summary);

/// What whoever uses the intervals has to know, a line each: that they reach to the values searched next to
/// the likely ones, as motions change too abruptly between them, and that the model does not fit.
std::vector<std::string> caveats(const Summary& summary);

/// What this search over these recordings cannot know, whatever its parameters: ratios to the weight where
/// the areal density is not measured, constants that were assumed, checks that were left out, and the
/// caveats.
std::vector<std::string> standing_unknowns(const Summary& summary);

}  // namespace flash::sysid
