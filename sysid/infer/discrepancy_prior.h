#pragma once

namespace flash::sysid {

/// Mean of the size of a discrepancy over the noise, where there is one: above the noise once in twenty.
inline constexpr double usual_discrepancy = 1 / 2.995732;

}  // namespace flash::sysid
