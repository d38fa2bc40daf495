#pragma once
#include <string>
#include <vector>

#include "data/motion/trajectory.h"

namespace flash::sysid {

/// Whether frames and trajectory were stamped by one clock. Throws data::InputError, naming the trajectory's
/// `path`, where more frames lie outside the trajectory than inside; what else is odd is returned for people
/// to read.
std::vector<std::string> compare_clocks(const std::vector<double>& times, const data::Trajectory& trajectory,
                                        const std::string& path);

}  // namespace flash::sysid
