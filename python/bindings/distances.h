#pragma once
#include <nanobind/nanobind.h>

#include <string>

#include "python/bindings/replay.h"

namespace flash::python {

/// What flash_sim.sysid.Distances has, by its names. `fit`: whether offset, yaw and clock are fitted within
/// the bounds of the recording, as for the score of the program; else they are zero.
nanobind::dict distances(const PreparedReplay& prepared, const Numbers& positions, const Numbers& forces,
                         bool fit, const std::string& distance, double trim, double huber, bool two_sided);

}  // namespace flash::python
