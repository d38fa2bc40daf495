#pragma once
#include <array>
#include <map>
#include <string>
#include <vector>

#include "data/asset/asset.h"
#include "sysid/report/summary.h"

namespace flash::sysid {

/// Range to draw a parameter from in training: its 95 % interval, and the whole searched range where the
/// recordings say nothing.
std::map<std::string, std::array<double, 2>> randomization_ranges(const Summary& summary);

/// The asset with what was identified: the mesh of the (first) recording; the estimate of each parameter that
/// is known, the best candidate's value of one that has a bound alone, and the base's value of one that the
/// recordings do not tell, with its source and without an interval; mass by the area of that mesh; and the
/// `identification` block of "flash-asset/1" (recordings, estimate, interval95, identifiable, fixed,
/// covariance_log, score_m, horizon_s, solver, tool_version, randomization, caveats). `base`: the asset the
/// search started from. Throws data::InputError where the summary holds no best candidate or its mesh cannot
/// be read.
data::Asset tuned_asset(const data::Asset& base, const Summary& summary);

}  // namespace flash::sysid
