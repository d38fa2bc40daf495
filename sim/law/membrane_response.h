#pragma once
#include <cmath>

#include "sim/law/host_device.h"
#include "sim/law/lanes.h"
#include "sim/law/membrane_law.h"
#include "sim/law/vector3.h"

namespace flash::sim {
inline namespace FLASH_LEVEL {

// The formulas of sim/law/membrane.h, for one triangle (Real = double) or several (Real = Lanes).

/// Deformation gradient (f1, f2) = s1 u1 v1^T + s2 u2 v2^T with s1 >= s2 >= 0, v1 = (c, s), v2 = (-s, c) and
/// n = u1 x u2.
template <typename Real>
struct SingularFrame {
  Real s1, s2, c, s;
  Vector3<Real> u1, u2, n;
};

/// The angle of v1 comes from the 2 x 2 matrix F^T F by half-angle formulas, s2 from the area |f1 x f2| = s1
/// s2, which keeps its relative accuracy where s2 is small. Where F is of rank one any normal serves (the
/// basis of Duff et al. 2017, "Building an orthonormal basis, revisited").
template <typename Real>
FLASH_HOST_DEVICE inline SingularFrame<Real> singular_frame(const Vector3<Real>& f1,
                                                            const Vector3<Real>& f2) {
  const Real zero{}, one = zero + 1.0, least = zero + 1e-150;
  const Real a = dot(f1, f1), b = dot(f1, f2), d = dot(f2, f2);
  const Real mean = 0.5 * (a + d), half = 0.5 * (a - d), radius = square_root(half * half + b * b);
  const Vector3<Real> normal = cross(f1, f2);
  const Real area = square_root(dot(normal, normal));
  SingularFrame<Real> r;
  r.s1 = square_root(mean + radius);
  const Real inverse_s1 = 1.0 / larger_of(r.s1, least);
  r.s2 = area * inverse_s1;
  const Real inverse_radius = 1.0 / larger_of(radius, least);
  const Real cos2 = select(radius > least, half * inverse_radius, one);
  const Real large = square_root(0.5 * (1.0 + magnitude(cos2))), small = 0.5 * b * inverse_radius / large;
  r.c = select(cos2 >= 0.0, large, magnitude(small));
  r.s = select(cos2 >= 0.0, small, with_sign(large, b));
  r.u1 = inverse_s1 * (r.c * f1 + r.s * f2);
  r.u1 = select(r.s1 > least, r.u1, {one, zero, zero});
  const Vector3<Real>& u = r.u1;
  const Real sign = with_sign(one, u.z), k = -1.0 / (sign + u.z);
  const Vector3<Real> any = {1.0 + sign * u.x * u.x * k, sign * u.x * u.y * k, -sign * u.x};
  const auto has_area = area > 1e-12 * r.s1 * r.s1;
  r.n = select(has_area, Vector3<Real>((1.0 / larger_of(area, least)) * normal), cross(u, any));
  r.u2 = cross(r.n, u);
  return r;
}

/// The energy and its derivatives by the singular values. flip = (p1 - p2)/(s1 - s2) and
/// twist = (p1 + p2)/(s1 + s2) are written so that nothing cancels at s1 = s2; bend_i = p_i / s_i.
template <typename Real>
struct PrincipalResponse {
  Real energy;
  Real p1, p2;
  Real p11, p12, p22;
  Real twist, flip;
  Real bend1, bend2;
};

/// J where a triangle is larger than collapsed, smooth in the vector f1 x f2 of that length below:
/// J' = j (3/8 + 3/4 u^2 - 1/8 u^4), u = J / j, j = collapsed_share, with two continuous derivatives at u
/// = 1.
template <typename Real>
struct SmoothArea {
  Real value, slope, slope_per_area, curvature;  ///< J', dJ'/dJ, (dJ'/dJ) / J, d^2J'/dJ^2
};

template <typename Real>
FLASH_HOST_DEVICE inline SmoothArea<Real> smooth_area(const Real& area) {
  const Real zero{}, one = zero + 1.0, u = (1.0 / collapsed_share) * area, squared = u * u;
  const auto whole = u >= 1.0;
  const Real per_u = 1.5 - 0.5 * squared;
  return {select(whole, area, Real(collapsed_share * (0.375 + (0.75 - 0.125 * squared) * squared))),
          select(whole, one, Real(per_u * u)),
          select(whole, Real(1.0 / larger_of(area, Real(zero + collapsed_share))),
                 Real((1.0 / collapsed_share) * per_u)),
          select(whole, zero, Real((1.5 / collapsed_share) * (1.0 - squared)))};
}

/// The corotated sheet; lambda = 0 gives the ARAP sheet. s1 + s2 = sqrt(s1^2 + s2^2 + 2 J) has a kink where a
/// triangle has become a line: J' in place of J takes it out, so that a sheet drawn so far that it becomes
/// one there has an equilibrium with a stress.
struct Corotated {
  template <typename Real>
  FLASH_HOST_DEVICE static PrincipalResponse<Real> at(const Real& s1, const Real& s2, double mu,
                                                      double lambda) {
    const Real zero{}, one = zero + 1.0, e1 = s1 - 1.0, e2 = s2 - 1.0;
    const SmoothArea<Real> area = smooth_area(Real(s1 * s2));
    const auto whole = s1 * s2 >= collapsed_share;
    // s1 + s2 and its derivatives, exact where nothing has collapsed: what follows cancels at small strains.
    const Real smooth = square_root(s1 * s1 + s2 * s2 + 2.0 * area.value);
    const Real excess = select(whole, zero, Real(smooth - (s1 + s2))), sum = s1 + s2 + excess;
    const Real inverse_sum = 1.0 / sum, strain = e1 + e2 + excess;
    const Real d1 = select(whole, one, Real((s1 + area.slope * s2) * inverse_sum)),
               d2 = select(whole, one, Real((s2 + area.slope * s1) * inverse_sum));
    const Real per_sum = (lambda * strain - 2 * mu) * inverse_sum;
    PrincipalResponse<Real> r;
    r.energy = mu * (e1 * e1 + e2 * e2 - 2.0 * excess) + 0.5 * lambda * strain * strain;
    r.p1 = 2 * mu * (s1 - d1) + lambda * strain * d1;
    r.p2 = 2 * mu * (s2 - d2) + lambda * strain * d2;
    const Real both = lambda - per_sum;
    r.p11 = 2 * mu + per_sum * (1.0 + area.curvature * s2 * s2) + both * d1 * d1;
    r.p22 = 2 * mu + per_sum * (1.0 + area.curvature * s1 * s1) + both * d2 * d2;
    r.p12 = per_sum * (area.slope + area.curvature * s1 * s2) + both * d1 * d2;
    r.twist = 2 * mu + per_sum * (1.0 + area.slope);
    r.flip = 2 * mu + per_sum * (1.0 - area.slope);
    r.bend1 = 2 * mu + per_sum * (1.0 + area.slope_per_area * s2 * s2);
    r.bend2 = 2 * mu + per_sum * (1.0 + area.slope_per_area * s1 * s1);
    return r;
  }
};

struct SaintVenantKirchhoff {
  template <typename Real>
  FLASH_HOST_DEVICE static PrincipalResponse<Real> at(const Real& s1, const Real& s2, double mu,
                                                      double lambda) {
    const Real c1 = s1 * s1 - 1.0, c2 = s2 * s2 - 1.0, trace = 0.5 * lambda * (c1 + c2);
    PrincipalResponse<Real> r;
    r.energy = 0.25 * mu * (c1 * c1 + c2 * c2) + 0.125 * lambda * (c1 + c2) * (c1 + c2);
    r.bend1 = mu * c1 + trace;
    r.bend2 = mu * c2 + trace;
    r.p1 = s1 * r.bend1;
    r.p2 = s2 * r.bend2;
    r.p11 = r.bend1 + (2 * mu + lambda) * s1 * s1;
    r.p22 = r.bend2 + (2 * mu + lambda) * s2 * s2;
    r.p12 = lambda * s1 * s2;
    const Real squares = s1 * s1 + s2 * s2 - 1.0;
    r.twist = mu * (squares - s1 * s2) + trace;
    r.flip = mu * (squares + s1 * s2) + trace;
    return r;
  }
};

struct NeoHookean {
  template <typename Real>
  FLASH_HOST_DEVICE static PrincipalResponse<Real> at(const Real& s1, const Real& s2, double mu,
                                                      double lambda) {
    // The square of the Hessian's entries, of 1 / least^2, has to be finite.
    const Real zero{}, least = zero + 1e-70, infinite = zero + HUGE_VAL;
    const Real area = larger_of(Real(s1 * s2), least), log_area = logarithm(area);
    const Real i1 = 1.0 / larger_of(s1, least), i2 = 1.0 / larger_of(s2, least);
    const Real pressure = lambda * log_area - mu;
    PrincipalResponse<Real> r;
    r.energy = select(s1 * s2 > 0.0,
                      Real(0.5 * mu * (s1 * s1 + s2 * s2 - 2.0) + (0.5 * lambda * log_area - mu) * log_area),
                      infinite);
    r.p1 = mu * s1 + pressure * i1;
    r.p2 = mu * s2 + pressure * i2;
    r.bend1 = mu + pressure * i1 * i1;
    r.bend2 = mu + pressure * i2 * i2;
    r.p11 = mu + (lambda - pressure) * i1 * i1;
    r.p22 = mu + (lambda - pressure) * i2 * i2;
    r.p12 = lambda / area;
    r.twist = mu + pressure / area;
    r.flip = mu - pressure / area;
    return r;
  }
};

/// Sets negative eigenvalues of the Hessian to zero.
template <typename Real>
FLASH_HOST_DEVICE inline void clamp(PrincipalResponse<Real>& r) {
  const Real zero{}, least = zero + 1e-150;
  const Real mean = 0.5 * (r.p11 + r.p22), half = 0.5 * (r.p11 - r.p22);
  const Real radius = square_root(half * half + r.p12 * r.p12);
  // One eigenvalue at most stays: A+ = l1 (A - l2 I) / (l1 - l2).
  const Real l1 = mean + radius, l2 = mean - radius;
  const Real scale = select(l1 > 0.0, Real(l1 / larger_of(Real(l1 - l2), least)), zero);
  const auto negative = l2 < 0.0;
  r.p11 = select(negative, Real(scale * (r.p11 - l2)), r.p11);
  r.p22 = select(negative, Real(scale * (r.p22 - l2)), r.p22);
  r.p12 = select(negative, Real(scale * r.p12), r.p12);
  r.twist = larger_of(r.twist, zero);
  r.flip = larger_of(r.flip, zero);
  r.bend1 = larger_of(r.bend1, zero);
  r.bend2 = larger_of(r.bend2, zero);
}

/// The two columns of the stress P.
template <typename Real>
struct StressColumns {
  Vector3<Real> p1, p2;
};

template <typename Real>
FLASH_HOST_DEVICE inline StressColumns<Real> stress_of(const SingularFrame<Real>& f,
                                                       const PrincipalResponse<Real>& r) {
  const Vector3<Real> t1 = r.p1 * f.u1, t2 = r.p2 * f.u2;
  return {f.c * t1 - f.s * t2, f.s * t1 + f.c * t2};
}

/// d p_i / d f_j as columns; h01 = d p1 / d f2.
template <typename Real>
struct HessianBlocks {
  Vector3<Real> h00[3], h01[3], h11[3];
};

/// H = sum_ij (v_i v_j^T) x B_ij with B_11 = p11 u1 u1^T + m u2 u2^T + bend1 n n^T, B_22 alike and B_12 = p12
/// u1 u2^T + k u2 u1^T, where m = (flip + twist)/2 and k = (flip - twist)/2.
template <typename Real>
FLASH_HOST_DEVICE inline HessianBlocks<Real> hessian_of(const SingularFrame<Real>& f,
                                                        const PrincipalResponse<Real>& r) {
  const Real m = 0.5 * (r.flip + r.twist), k = 0.5 * (r.flip - r.twist);
  const Real cc = f.c * f.c, ss = f.s * f.s, cs = f.c * f.s, sum = r.p12 + k;
  // Each block as u1 a u1^T + u1 b u2^T + u2 c u1^T + u2 d u2^T + n e n^T.
  const Real a00 = cc * r.p11 + ss * m, d00 = cc * m + ss * r.p22, e00 = cc * r.bend1 + ss * r.bend2;
  const Real a11 = ss * r.p11 + cc * m, d11 = ss * m + cc * r.p22, e11 = ss * r.bend1 + cc * r.bend2;
  const Real b11 = cs * sum, b00 = -b11;
  const Real a01 = cs * (r.p11 - m), d01 = cs * (m - r.p22), e01 = cs * (r.bend1 - r.bend2);
  const Real b01 = cc * r.p12 - ss * k, c01 = cc * k - ss * r.p12;
  const Real x[3] = {f.u1.x, f.u1.y, f.u1.z}, y[3] = {f.u2.x, f.u2.y, f.u2.z}, z[3] = {f.n.x, f.n.y, f.n.z};
  const auto column = [&](int j, const Real& a, const Real& b, const Real& c, const Real& d, const Real& e) {
    return Real(a * x[j] + b * y[j]) * f.u1 + Real(c * x[j] + d * y[j]) * f.u2 + Real(e * z[j]) * f.n;
  };
  HessianBlocks<Real> H;
  for (int j = 0; j < 3; ++j) {
    H.h00[j] = column(j, a00, b00, b00, d00, e00);
    H.h01[j] = column(j, a01, b01, c01, d01, e01);
    H.h11[j] = column(j, a11, b11, b11, d11, e11);
  }
  return H;
}

/// Calls work(law) with the law's formulas.
template <typename Work>
auto with_membrane_law(MembraneLaw law, const Work& work) {
  if (law == MembraneLaw::saint_venant_kirchhoff) return work(SaintVenantKirchhoff{});
  if (law == MembraneLaw::neo_hookean) return work(NeoHookean{});
  return work(Corotated{});
}

}  // namespace FLASH_LEVEL
}  // namespace flash::sim
