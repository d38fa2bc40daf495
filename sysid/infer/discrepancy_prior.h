#pragma once

namespace flash::sysid {

/// Mean of the size of a discrepancy over the noise, where there is one. Chosen: an exponential prior after
/// Simpson et al. 2017, above the noise once in twenty (1 / log 20); not varied.
inline constexpr double usual_discrepancy = 1 / 2.995732;

}  // namespace flash::sysid
