#pragma once
#include <cmath>

/// Rows of the non-smooth Newton system on the multipliers lambda [N] of gaps c [m].
///
/// With dx = dx_free + h^2 A^-1 H^T dlambda and W = H A^-1 H^T, a row phi(c, lambda) = 0 linearised at (c,
/// lambda) is
///
///     h^2 (omega W + E) dlambda = rhs,   omega = dphi/dc,   h^2 E = dphi/dlambda,   rhs = -phi + omega (c -
///     c_free),
///
/// where c_free is the gap that the step reaches with dlambda = 0. Macklin et al. 2019, sec. 5; Zeng et al.
/// 2025.
namespace flash::sim {

struct ConstraintRow {
  double omega;       ///< weight of the row on the motion, in [0, 1]
  double compliance;  ///< E [1/kg]
  double rhs;         ///< [m]
};

/// The two tangential rows of one contact share weight and compliance, so that no direction of the plane is
/// special.
struct FrictionRows {
  double omega;
  double compliance;  ///< E [1/kg]
  double rhs[2];      ///< [m]
};

/// phi = c + r lambda - sqrt(c^2 + r^2 lambda^2) [m], zero exactly where c >= 0, lambda >= 0, c lambda = 0.
inline double fischer_burmeister(double gap, double multiplier, double r) {
  return gap + r * multiplier - std::sqrt(gap * gap + r * r * multiplier * multiplier);
}

/// Normal contact by Fischer-Burmeister. r = h^2 W_nn [m/N] makes both arguments lengths of one size. At the
/// kink c = lambda = 0 the row is the element (1 - 1/sqrt(2)) (1, r) of the generalised gradient, which keeps
/// E > 0.
inline ConstraintRow normal_row_fischer_burmeister(double gap, double free_gap, double multiplier, double r,
                                                   double h) {
  const double scaled = r * multiplier;
  const double rho = std::sqrt(gap * gap + scaled * scaled);
  const double half = 0.70710678118654752;
  const double cosine = rho > 0 ? gap / rho : half;
  const double sine = rho > 0 ? scaled / rho : half;
  const double omega = 1 - cosine;
  return {omega, (1 - sine) * r / (h * h), -(gap + scaled - rho) + omega * (gap - free_gap)};
}

/// Normal contact by the minimum map phi = min(c, r lambda): active where c < r lambda. At the kink c = r
/// lambda the row is the inactive branch.
inline ConstraintRow normal_row_minimum_map(double gap, double free_gap, double multiplier, double r,
                                            double h) {
  if (gap < r * multiplier) return {1, 0, -free_gap};
  return {0, r / (h * h), -r * multiplier};
}

/// Coulomb friction on the disc |lambda_t| <= mu lambda_n, at most dissipative: c_t = -h^2 E lambda_t with
/// the scalar
///
///     E = (rho - t) / (u + r mu lambda_n - rho) r / h,  u = |c_t| / h,  t = r (mu lambda_n - |lambda_t|),
///     rho = sqrt(u^2 + t^2),  r = h W_tt [m/(N s)],
///
/// frozen over one Newton step. E = 0 sticks; where Fischer-Burmeister of (u, t) vanishes, h^2 E = |c_t| /
/// |lambda_t|. The caller projects lambda_t on the disc after each step. Multipliers outside count as on the
/// rim, which keeps E >= 0. Without normal force (or mu = 0) the rows say lambda_t = 0. slip: c_t since the
/// start of the step [m]; free_slip: the same with dlambda = 0.
inline FrictionRows friction_rows(const double slip[2], const double free_slip[2], const double multiplier[2],
                                  double normal_multiplier, double friction, double r, double h) {
  const double limit = friction * normal_multiplier;
  if (!(limit > 0)) return {0, 1 / h, {-h * multiplier[0], -h * multiplier[1]}};
  const double u = std::sqrt(slip[0] * slip[0] + slip[1] * slip[1]) / h;
  const double size = std::sqrt(multiplier[0] * multiplier[0] + multiplier[1] * multiplier[1]);
  const double t = size < limit ? r * (limit - size) : 0;
  const double rho = std::sqrt(u * u + t * t);
  // rho - t, without cancellation where it is small against t.
  const double excess = rho + t > 0 ? u * u / (rho + t) : 0;
  const double denominator = u + (r * limit - t) - excess;
  const double compliance = excess > 0 ? excess / denominator * r / h : 0;
  return {1,
          compliance,
          {-h * h * compliance * multiplier[0] - free_slip[0],
           -h * h * compliance * multiplier[1] - free_slip[1]}};
}

/// Friction rows in the frame of the slip: `along` the unit direction in which friction pushes, and `across`
/// it.
struct SlipRows {
  double direction[2];
  ConstraintRow along, across;
};

/// Coulomb friction by the exact derivative of lambda_t - P_{mu lambda_n}(lambda_t - c_t / r), P the
/// projection on the disc, at frozen lambda_n (Alart and Curnier 1991). With q = lambda_t - c_t / r and a =
/// mu lambda_n / |q|: inside the disc both rows stick, c_t = 0; outside, along q lambda_t = mu lambda_n, and
/// across it c + r (1 - a) / a lambda = 0. r = h^2 W_tt [m/N]. As above where there is no normal force.
inline SlipRows slip_rows(const double slip[2], const double free_slip[2], const double multiplier[2],
                          double normal_multiplier, double friction, double r, double h) {
  const double limit = friction * normal_multiplier;
  if (!(limit > 0)) return {{1, 0}, {0, 1 / h, -h * multiplier[0]}, {0, 1 / h, -h * multiplier[1]}};
  const double q[2] = {multiplier[0] - slip[0] / r, multiplier[1] - slip[1] / r};
  const double size = std::sqrt(q[0] * q[0] + q[1] * q[1]);
  if (size <= limit) return {{1, 0}, {1, 0, -free_slip[0]}, {1, 0, -free_slip[1]}};
  const double e[2] = {q[0] / size, q[1] / size}, a = limit / size;
  const double multiplier_along = e[0] * multiplier[0] + e[1] * multiplier[1];
  const double multiplier_across = e[0] * multiplier[1] - e[1] * multiplier[0];
  const double slip_across = e[0] * slip[1] - e[1] * slip[0];
  const double free_across = e[0] * free_slip[1] - e[1] * free_slip[0];
  // The across component of q is zero, so that the function is the multiplier itself there.
  return {{e[0], e[1]},
          {0, 1 / h, h * (limit - multiplier_along)},
          {1, r * (1 - a) / (a * h * h), -r / a * multiplier_across + slip_across - free_across}};
}

/// Bilateral row c + h^2 E lambda = 0, never clamped: grasps and supports. compliance 0 [1/kg] is rigid. A
/// moving anchor enters through free_gap, which is taken against the anchor at the end of the step.
inline ConstraintRow bilateral_row(double free_gap, double multiplier, double compliance, double h) {
  return {1, compliance, -free_gap - h * h * compliance * multiplier};
}

/// Nearest multiplier on the disc |lambda_t| <= mu max(lambda_n, 0).
inline void project_on_disc(double multiplier[2], double normal_multiplier, double friction) {
  const double limit = normal_multiplier > 0 ? friction * normal_multiplier : 0;
  const double size = std::sqrt(multiplier[0] * multiplier[0] + multiplier[1] * multiplier[1]);
  if (size <= limit) return;
  const double scale = limit / size;
  multiplier[0] *= scale;
  multiplier[1] *= scale;
}

/// |min(c, r lambda)| [m]: what is left of complementarity, r = h^2 W_nn.
inline double normal_violation(double gap, double multiplier, double r) {
  return std::fabs(std::fmin(gap, r * multiplier));
}

/// Distance of lambda_t to its projected step, scaled to metres: | r lambda_t - P_{r mu lambda_n}(r lambda_t
/// - c_t) |, r = h^2 W_tt. Zero exactly where Coulomb's law holds.
inline double friction_violation(const double slip[2], const double multiplier[2], double normal_multiplier,
                                 double friction, double r) {
  double target[2] = {r * multiplier[0] - slip[0], r * multiplier[1] - slip[1]};
  project_on_disc(target, r * normal_multiplier, friction);
  const double a = r * multiplier[0] - target[0], b = r * multiplier[1] - target[1];
  return std::sqrt(a * a + b * b);
}

}  // namespace flash::sim
