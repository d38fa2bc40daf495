#pragma once
#include <cmath>

#include "sim/law/host_device.h"
#include "sim/law/membrane_law.h"
#include "sim/law/vector3.h"

namespace flash::sim {
inline namespace FLASH_LEVEL {

// The stress of sim/law/membrane.h in closed form, without singular values, for numbers of either precision.
// With N = f1 x f2, J = |N| and n = N / J the cofactors of F = (f1, f2) are (f2 x n, n x f1) = dJ / dF, so
// that the sum of the singular values is t = sqrt(|F|^2 + 2 J), and the nearest rotation (F + dJ / dF) / t.

/// dJ'/dJ / J of the smooth area J' (sim/law/membrane_response.h): 1 / J where a triangle has not collapsed.
/// `smooth`: J'.
template <typename Number>
FLASH_HOST_DEVICE inline Number slope_per_area(Number area, Number& smooth) {
  const Number j = Number(collapsed_share), u = area / j, squared = u * u;
  smooth = area;
  if (u >= Number(1)) return Number(1) / area;
  smooth = j * (Number(0.375) + (Number(0.75) - Number(0.125) * squared) * squared);
  return (Number(1.5) - Number(0.5) * squared) / j;
}

/// P = dPsi/dF (first Piola-Kirchhoff) [N/m] for the columns f1 and f2 of F.
template <typename Number>
FLASH_HOST_DEVICE inline void membrane_stress(MembraneLaw law, Number mu, Number lambda,
                                              const Vector3<Number>& f1, const Vector3<Number>& f2,
                                              Vector3<Number>& p1, Vector3<Number>& p2) {
  const Number a = dot(f1, f1), b = dot(f1, f2), d = dot(f2, f2), one = Number(1), two = Number(2);
  if (law == MembraneLaw::saint_venant_kirchhoff) {
    const Number trace = lambda * ((a + d) / two - one);
    p1 = Number(mu * (a - one) + trace) * f1 + Number(mu * b) * f2;
    p2 = Number(mu * b) * f1 + Number(mu * (d - one) + trace) * f2;
    return;
  }
  const Vector3<Number> normal = cross(f1, f2);
  const Number squared = dot(normal, normal), area = std::sqrt(squared);
  Number of_F, of_cofactors;  // P = of_F F + of_cofactors J dJ/dF
  if (law == MembraneLaw::neo_hookean) {
    constexpr Number least = sizeof(Number) == sizeof(float) ? Number(1e-18) : Number(1e-70);
    const Number size = area > least ? area : least;
    of_F = mu;
    of_cofactors = (lambda * std::log(size) - mu) / (size * size);
  } else {
    Number smooth;
    const Number slope = slope_per_area(area, smooth), sum = std::sqrt(a + d + two * smooth);
    const Number per_sum = (lambda * (sum - two) - two * mu) / sum;
    of_F = two * mu + per_sum;
    of_cofactors = per_sum * slope;
  }
  p1 = of_F * f1 + of_cofactors * cross(f2, normal);
  p2 = of_F * f2 + of_cofactors * cross(normal, f1);
}

}  // namespace FLASH_LEVEL
}  // namespace flash::sim
