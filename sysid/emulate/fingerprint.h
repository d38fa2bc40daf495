#pragma once
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "sysid/emulate/grid_search.h"

namespace flash::sysid {

/// What decides the results of a search, under the names of files and options: numbers and words as they are
/// ("time_step_s" "0.01", "axis bending" "1e-05 0.0001"), data as a hash ("recording lift_a keyframes"), the
/// program as its version and a hash of its sources. What decides only how fast they come (threads, envs) is
/// left out.
Fingerprint fingerprint(const std::vector<Replay>& replays, const GridSettings& settings);

/// "" where equal, else one phrase: "time_step_s was 0.01 and is 0.005, and 2 more".
std::string difference(const Fingerprint& was, const Fingerprint& is);

/// A search's file that is of another one, and by what.
struct OtherSearch {
  std::string file, difference;
};

/// The first of those `files`, each a grid.json, that is of another search; empty where all are of this one.
std::optional<OtherSearch> other_search(const Fingerprint& search, const std::vector<std::string>& files);

}  // namespace flash::sysid
