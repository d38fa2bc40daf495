#pragma once

namespace flash::sim {

/// Share of the steps of a run that may miss the tolerance.
inline constexpr double accepted_share = 0.01;

/// Residual |r| / |M g| that none of them may exceed: forces out of balance by the whole weight.
inline constexpr double accepted_residual = 1.0;

/// Whether the motion of a run may be used, with `unconverged_share` of its steps above the tolerance.
inline bool accepted(double unconverged_share, double residual_max) {
  return unconverged_share <= accepted_share && (unconverged_share == 0 || residual_max <= accepted_residual);
}

}  // namespace flash::sim
