#pragma once
#include "sim/law/constraint_row.h"

/// A contact as the non-smooth Newton method on multipliers sees it: its gap and two slips against three
/// multipliers, which act through their own compliances h^2 W_ii alone or through those of others too.
namespace flash::sim {

/// How the rows of contacts are written, as in ConstraintSettings.
struct ContactRowKind {
  bool fischer_burmeister;  ///< else the minimum map
  bool fixed_point;         ///< of friction, else the exact derivative
};

/// The rows of a contact, tangential ones in the frame (cosine, sine) of their own.
struct ContactRows {
  ConstraintRow rows[3];
  double cosine = 1, sine = 0;
  bool slides = false;
};

/// diagonal: W_ii [1/kg]; h: time step [s].
inline ContactRows contact_rows(const ContactRowKind& kind, const double gap[3], const double multiplier[3],
                                double friction, const double diagonal[3], double h) {
  const double r = h * h * diagonal[0], tangential = 0.5 * (diagonal[1] + diagonal[2]);
  ContactRows at;
  at.rows[0] = kind.fischer_burmeister ? normal_row_fischer_burmeister(gap[0], gap[0], multiplier[0], r, h)
                                       : normal_row_minimum_map(gap[0], gap[0], multiplier[0], r, h);
  if (kind.fixed_point) {
    const FrictionRows t =
        friction_rows(gap + 1, gap + 1, multiplier + 1, multiplier[0], friction, h * tangential, h);
    for (int k = 0; k < 2; ++k) at.rows[1 + k] = {t.omega, t.compliance, t.rhs[k]};
    return at;
  }
  const SlipRows t =
      slip_rows(gap + 1, gap + 1, multiplier + 1, multiplier[0], friction, h * h * tangential, h);
  at.rows[1] = t.along;
  at.rows[2] = t.across;
  at.cosine = t.direction[0];
  at.sine = t.direction[1];
  at.slides = t.along.omega == 0;
  return at;
}

/// A sliding contact follows its normal force to the new rim of the disc, which the frozen one has missed.
inline void follow_rim(const ContactRows& at, double friction, double multiplier[3]) {
  if (!at.slides) return;
  const double size = std::sqrt(multiplier[1] * multiplier[1] + multiplier[2] * multiplier[2]);
  if (!(size > 0)) return;
  const double scale = friction * (multiplier[0] > 0 ? multiplier[0] : 0) / size;
  multiplier[1] *= scale;
  multiplier[2] *= scale;
}

/// To 0 <= lambda_n <= max_force and |lambda_t| <= mu lambda_n.
inline void project_multiplier(double max_force, double friction, double multiplier[3]) {
  multiplier[0] = std::fmin(std::fmax(multiplier[0], 0.0), max_force);
  project_on_disc(multiplier + 1, multiplier[0], friction);
}

/// What is left of Signorini's and of Coulomb's law [m].
struct ContactViolation {
  double normal, tangential;
};
inline ContactViolation contact_violation(const double gap[3], const double multiplier[3], double friction,
                                          const double diagonal[3], double h) {
  const double r = 0.5 * h * h * (diagonal[1] + diagonal[2]);
  return {normal_violation(gap[0], multiplier[0], h * h * diagonal[0]),
          friction_violation(gap + 1, multiplier + 1, multiplier[0], friction, r)};
}

}  // namespace flash::sim
