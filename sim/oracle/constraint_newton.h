#pragma once
#include <Eigen/Core>

#include "sim/oracle/constraint_solver.h"

namespace flash::sim {

/// How the normal rows of contact are written.
enum class Complementarity { minimum_map, fischer_burmeister };

/// How the friction rows are linearised. fixed_point: the published scalar compliance; linear convergence,
/// slow where sliding contacts are coupled. newton: the exact derivative across the slip and the rim of the
/// disc along it, both at frozen normal force.
enum class FrictionRow { newton, fixed_point };

struct ConstraintSettings {
  Complementarity complementarity = Complementarity::minimum_map;
  FrictionRow friction = FrictionRow::newton;
  int iterations = 50;       ///< Newton steps on the multipliers
  double tolerance = 1e-14;  ///< on the worst violation of a row, |min(c, r lambda)|, friction alike [m]
  double max_force = 1e10;   ///< clamp on lambda_n [N]
  double damping = 0;  ///< fixed step length in (0, 1], 0.75 as published; 0: the best of 1, 1/2, 1/4, 1/8
  DualSolverSettings linear{};
};

/// Contacts with gaps linear in their multipliers, c(lambda) = free_gap + h^2 W lambda. Contact k has the
/// rows 3 k (gap along the normal) and 3 k + 1, 3 k + 2 (slip along two orthogonal tangents since the start
/// of the step).
struct ContactProblem {
  double time_step = 0.01;  ///< h [s]
  Eigen::MatrixXd W;        ///< 3 n x 3 n [1/kg]; empty: `apply_W` and `diagonal` instead
  Operator apply_W;
  Eigen::VectorXd diagonal;  ///< of W [1/kg]; may stay empty when W is given
  Eigen::VectorXd free_gap;  ///< gaps and slips at lambda = 0 [m]
  Eigen::VectorXd friction;  ///< mu, one a contact
};

struct ConstraintReport {
  int iterations = 0;         ///< Newton steps
  int linear_iterations = 0;  ///< of the linear solver, summed
  double violation = 0;       ///< worst row [m]
  bool converged = false;
};

/// Worst violation of Signorini's and Coulomb's law over the contacts, |min(c, r lambda_n)| and the distance
/// of lambda_t to its projected step [m].
double contact_violation(const ContactProblem& problem, const Eigen::VectorXd& gap,
                         const Eigen::VectorXd& multiplier);

/// Non-smooth Newton on the multipliers [N], warm started from what `multiplier` holds. Every iterate obeys
/// 0 <= lambda_n <= max_force and |lambda_t| <= mu lambda_n.
ConstraintReport solve_contacts(const ContactProblem& problem, const ConstraintSettings& settings,
                                Eigen::VectorXd& multiplier);

}  // namespace flash::sim
