#pragma once
#include <string>

#include "calib/dataset/edge_offset.h"
#include "calib/dataset/target_shape.h"

namespace flash::calib {

/// Whether pictures tell a number of a target's warp, or where its edges stand: to half of what was known
/// beforehand. Four corners tell the twist at most.
bool told(const WarpEstimate& warp, Eigen::Index number);
bool told(const EdgeOffset& edges);

/// "its middle 0.31 +- 0.05 mm behind its ends along x, twisted by 0.10 +- 0.04 mm": what pictures tell, each
/// number with so many standard deviations. Empty where they tell nothing.
std::string describe(const WarpEstimate& warp, double deviations = 1);

}  // namespace flash::calib
