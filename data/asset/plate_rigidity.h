#pragma once

namespace flash::data {

/// Bending rigidity of a plate, E t^3 / (12 (1 - nu^2)) [N m], of E [Pa] and t [m].
inline double plate_rigidity(double youngs_modulus, double poissons_ratio, double thickness) {
  return youngs_modulus * thickness * thickness * thickness / (12 * (1 - poissons_ratio * poissons_ratio));
}

}  // namespace flash::data
