#pragma once

namespace flash::sim {

/// Steps after which a solver forgets what it holds besides the state of its environment. A replay that goes
/// on from a state at a multiple of them is bitwise the one that was not interrupted.
inline constexpr int restart_interval = 50;

/// The same of Newton's method on a device, where a team may change with it.
inline constexpr int device_restart_interval = 10;

static_assert(restart_interval % device_restart_interval == 0,
              "where the processor forgets, so does the device");

}  // namespace flash::sim
