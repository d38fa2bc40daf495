#pragma once

namespace flash::sim {

/// What a vertex may do at the current iterate of a step.
enum class Freedom {
  free,
  held,  ///< some axes obey a hold
  slip,  ///< along the surfaces that hold it
};

/// Gap up to which a vertex is on a surface: rounding of a projected position [m].
inline constexpr double touching_gap = 1e-10;

/// Slip up to which a vertex has not moved: rounding of a position [m].
inline constexpr double resting_slip = 1e-13;

}  // namespace flash::sim
