#pragma once
#include "sim/law/vector3.h"

namespace flash::sim {
inline namespace FLASH_LEVEL {

/// Pressure between two layers of cloth, per area: its energy, its force and its stiffness.
struct LayerResponse {
  double energy = 0;     ///< [J/m^2]
  double force = 0;      ///< [Pa]
  double stiffness = 0;  ///< [Pa/m]
};

/// Layers feel each other from their `thickness` t on, and never meet:
///
///   e(d) = -p t (1 - u)^2 ln u,   u = d / t < 1
///
/// It is twice differentiable (the barrier of Li et al. 2020, of a length in place of its square). The force
/// begins as 3 p (1 - u)^2, reaches the `pressure` p at u = 0.53, and grows without bound.
FLASH_HOST_DEVICE inline LayerResponse layer_response(double thickness, double pressure, double distance) {
  const double u = distance / thickness, s = 1 - u;
  if (!(s > 0)) return {};
  const double log_u = logarithm(u);
  return {-pressure * thickness * s * s * log_u, pressure * (s * s / u - 2 * s * log_u),
          pressure / thickness * (s * s / (u * u) + 4 * s / u - 2 * log_u)};
}

}  // namespace FLASH_LEVEL
}  // namespace flash::sim
