#pragma once
#include <optional>

#include "sysid/replay/replay.h"

namespace flash::sysid {

/// The same recording on cells of half the size, keyframes weighing as they do; empty where the sheet is not
/// given by a specification or lies in a shape of its own.
std::optional<Replay> on_half_the_cell(const Replay& replay);

}  // namespace flash::sysid
