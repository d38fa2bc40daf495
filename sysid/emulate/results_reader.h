#pragma once
#include <string>

#include "sysid/emulate/grid_results.h"

namespace flash::sysid {

/// The tables in the folder of a search: a line a candidate; a candidate and recording; a candidate,
/// recording and keyframe. All three are in the same order of candidates, as ResultsStore appends them.
inline constexpr const char* result_tables[] = {"results.csv", "registrations.csv", "keyframes.csv"};

/// What becomes of candidates at the end that are not there as a whole, in all three tables. A search that
/// was killed leaves them.
enum class Incomplete { refuse, leave_out };

/// Reads a folder that ResultsStore wrote. Throws data::InputError naming file and line where it holds what
/// no search can have written: a candidate that is not of the grid, or there twice; another registration than
/// one a recording; keyframes of another time, number of points or weight than those of the other candidates;
/// a score that is not the mean of those it was formed from; values out of range; lines of a candidate that
/// are not those of its digest.
GridResults load_grid_results(const std::string& folder, Incomplete incomplete = Incomplete::refuse);

}  // namespace flash::sysid
