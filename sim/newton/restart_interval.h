#pragma once

namespace flash::sim {

/// Steps after which a solver forgets what it holds besides the state of its environment. A replay that goes
/// on from a state at a multiple of them is bitwise the one that was not interrupted.
inline constexpr int restart_interval = 50;

}  // namespace flash::sim
