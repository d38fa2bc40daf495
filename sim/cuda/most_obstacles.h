#pragma once

namespace flash::sim {

/// Obstacles of an environment that the kernels have room for.
inline constexpr int most_obstacles = 8;

}  // namespace flash::sim
