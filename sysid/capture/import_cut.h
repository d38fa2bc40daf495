#pragma once
#include <optional>

#include "sysid/capture/import.h"

namespace flash::sysid {

/// Leaves out what was recorded before `from` and after `until`, by the clock of the trajectory [s]: frames,
/// their times, and poses of the gripper. The trajectory begins and ends with the poses at these times. Where
/// `settings` has no times, the frames count as 10 a second. Throws data::InputError that names --from or
/// --until where no frame is left, and where `from` is no time of the trajectory.
void cut(std::optional<double> from, std::optional<double> until, ImportSettings& settings);

}  // namespace flash::sysid
