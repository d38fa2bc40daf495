#pragma once
#include <vector>

#include "sysid/zoom.h"

namespace flash::sysid {

/// Values at which motions are simulated anew about an answer: `count` over the extent of an axis, evenly,
/// where that is no wider than a cell of the search; else the values of the search.
std::vector<Axis> lattice(const Extent& extent, const std::vector<Axis>& searched, int count);

/// Where to simulate next: `extent` itself where every interval of the verdict ends inside it or with the
/// searched range, and `zoomed`, the extent that it was read on, is half of it or more. Else an extent about
/// the estimate, twice as far on a side that an interval leaves.
Extent next_lattice(const Extent& extent, const Extent& zoomed, const GridVerdict& verdict,
                    const std::vector<Axis>& searched);

}  // namespace flash::sysid
