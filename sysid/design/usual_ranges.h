#pragma once
#include <vector>

#include "sysid/emulate/parameter_grid.h"

namespace flash::sysid {

/// What may be unknown of a cloth, unless told: young (a factor of 5 about the asset's), poisson (0 to 0.45),
/// bending (a factor of 10 about the asset's; 618 fabrics measured: 1 to 110 uN m at 5 and 95 %) and friction
/// (0.15 to 0.6). Two values an axis, the ends.
std::vector<Axis> usual_ranges(const MaterialBase& base);

/// The asset's own value of each axis, or the nearest in its range; 0 of what belongs to a recording.
std::vector<double> values_in_range(const MaterialBase& base, const std::vector<Axis>& axes);

}  // namespace flash::sysid
