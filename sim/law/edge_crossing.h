#pragma once
#include "sim/law/vector3.h"

namespace flash::sim {
inline namespace FLASH_LEVEL {

/// Squared sine of the angle between two edges from which on they cross as they are.
inline constexpr double crossing_squared_sine = 1e-2;

/// What the edges x[0] x[1] and x[2] x[3] count, q (2 - q) with q their squared sine over the one above, at
/// most 1. It takes parallel edges out smoothly: their nearest points jump, and their ends meet the faces
/// beside them anyway (Li et al. 2020).
struct Crossing {
  double factor = 1;
  double slope = 0;                         ///< of the factor by q
  Vector3<double> by_first{}, by_second{};  ///< derivatives of the factor by x[1] - x[0] and x[3] - x[2]
};

FLASH_HOST_DEVICE inline Crossing crossing_of(const Vector3<double>* x) {
  const Vector3<double> u = x[1] - x[0], v = x[3] - x[2];
  const double uu = dot(u, u), vv = dot(v, v), uv = dot(u, v);
  const double q = (1 - uv * uv / (uu * vv)) / crossing_squared_sine;
  if (q >= 1) return {};
  // The derivative of the squared sine by u: -2 (u.v) / (uu vv) (v - u (u.v) / uu).
  const double slope = 2 - 2 * q, scale = slope * -2 * uv / (uu * vv * crossing_squared_sine);
  return {q * (2 - q), slope, scale * (v - (uv / uu) * u), scale * (u - (uv / vv) * v)};
}

}  // namespace FLASH_LEVEL
}  // namespace flash::sim
