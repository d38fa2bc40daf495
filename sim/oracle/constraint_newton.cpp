#include "sim/oracle/constraint_newton.h"

#include <algorithm>
#include <cmath>

#include "sim/law/contact_newton.h"

namespace flash::sim {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

VectorXd gaps(const ContactProblem& problem, const VectorXd& multiplier) {
  VectorXd w(multiplier.size());
  if (problem.W.size() > 0)
    w.noalias() = problem.W * multiplier;
  else
    problem.apply_W(multiplier, w);
  return problem.free_gap + problem.time_step * problem.time_step * w;
}

VectorXd diagonal_of(const ContactProblem& problem) {
  return problem.diagonal.size() > 0 ? problem.diagonal : VectorXd(problem.W.diagonal());
}

/// Squared violations summed, the merit of the step length.
double violations(const ContactProblem& problem, const VectorXd& diagonal, const VectorXd& gap,
                  const VectorXd& multiplier, double& worst) {
  double sum = 0;
  worst = 0;
  for (Index k = 0; k < problem.friction.size(); ++k) {
    const ContactViolation of_contact = contact_violation(
        &gap[3 * k], &multiplier[3 * k], problem.friction[k], &diagonal[3 * k], problem.time_step);
    sum += of_contact.normal * of_contact.normal + of_contact.tangential * of_contact.tangential;
    worst = std::max({worst, of_contact.normal, of_contact.tangential});
  }
  return sum;
}

/// The rows of all contacts.
struct Linearisation {
  std::vector<ContactRows> contacts;

  std::vector<ConstraintRow> rows() const {
    std::vector<ConstraintRow> all;
    for (const ContactRows& contact : contacts) all.insert(all.end(), contact.rows, contact.rows + 3);
    return all;
  }
};

Linearisation linearise(const ContactProblem& problem, const ConstraintSettings& settings,
                        const VectorXd& diagonal, const VectorXd& gap, const VectorXd& multiplier) {
  const ContactRowKind kind = {settings.complementarity == Complementarity::fischer_burmeister,
                               settings.friction == FrictionRow::fixed_point};
  Linearisation at;
  for (Index k = 0; k < problem.friction.size(); ++k)
    at.contacts.push_back(contact_rows(kind, &gap[3 * k], &multiplier[3 * k], problem.friction[k],
                                       &diagonal[3 * k], problem.time_step));
  return at;
}

/// Tangential rows of x from the contacts' bases into the frames of their rows (direction 1) or back (-1).
template <typename Matrix>
void turn(const Linearisation& at, int direction, Matrix&& x) {
  for (Index k = 0; k < static_cast<Index>(at.contacts.size()); ++k) {
    const double c = at.contacts[k].cosine, s = direction * at.contacts[k].sine;
    if (s == 0 && c == 1) continue;
    const auto first = x.row(3 * k + 1).eval(), second = x.row(3 * k + 2).eval();
    x.row(3 * k + 1) = c * first + s * second;
    x.row(3 * k + 2) = c * second - s * first;
  }
}

DualSolution newton_step(const ContactProblem& problem, const Linearisation& at, const VectorXd& diagonal,
                         const DualSolverSettings& settings) {
  DualSolution step;
  if (problem.W.size() > 0) {
    Eigen::MatrixXd W = problem.W;
    turn(at, 1, W);
    turn(at, 1, W.transpose());
    step = solve_dual(W, at.rows(), problem.time_step, settings);
  } else {
    const Operator turned = [&](const VectorXd& l, VectorXd& w) {
      VectorXd own = l;
      turn(at, -1, own);
      problem.apply_W(own, w);
      turn(at, 1, w);
    };
    step = solve_dual(turned, diagonal, at.rows(), problem.time_step, settings);
  }
  turn(at, -1, step.x);
  return step;
}

void project(const ContactProblem& problem, double max_force, VectorXd& multiplier) {
  for (Index k = 0; k < problem.friction.size(); ++k)
    project_multiplier(max_force, problem.friction[k], &multiplier[3 * k]);
}

}  // namespace

double contact_violation(const ContactProblem& problem, const VectorXd& gap, const VectorXd& multiplier) {
  double worst = 0;
  violations(problem, diagonal_of(problem), gap, multiplier, worst);
  return worst;
}

ConstraintReport solve_contacts(const ContactProblem& problem, const ConstraintSettings& settings,
                                VectorXd& multiplier) {
  ConstraintReport report;
  const VectorXd diagonal = diagonal_of(problem);
  project(problem, settings.max_force, multiplier);
  VectorXd gap = gaps(problem, multiplier);
  double merit = violations(problem, diagonal, gap, multiplier, report.violation);
  VectorXd best = multiplier;
  double best_violation = report.violation;
  while (report.violation > settings.tolerance && report.iterations < settings.iterations) {
    const Linearisation at = linearise(problem, settings, diagonal, gap, multiplier);
    const DualSolution step = newton_step(problem, at, diagonal, settings.linear);
    ++report.iterations;
    report.linear_iterations += step.iterations;
    const VectorXd start = multiplier;
    double accepted = -1;
    const double first = settings.damping > 0 ? settings.damping : 1.0;
    const double last = settings.damping > 0 ? settings.damping : 0.125;
    for (double length = first; length >= last; length *= 0.5) {
      VectorXd trial = start + length * step.x;
      for (std::size_t k = 0; k < at.contacts.size(); ++k)
        follow_rim(at.contacts[k], problem.friction[static_cast<Index>(k)],
                   &trial[3 * static_cast<Index>(k)]);
      project(problem, settings.max_force, trial);
      const VectorXd trial_gap = gaps(problem, trial);
      double worst = 0;
      const double trial_merit = violations(problem, diagonal, trial_gap, trial, worst);
      if (accepted < 0 || trial_merit < accepted) {
        accepted = trial_merit;
        multiplier = trial;
        gap = trial_gap;
        report.violation = worst;
      }
      if (accepted < merit) break;
    }
    merit = accepted;
    if (report.violation < best_violation) {
      best_violation = report.violation;
      best = multiplier;
    }
  }
  multiplier = best;
  report.violation = best_violation;
  report.converged = report.violation <= settings.tolerance;
  return report;
}

}  // namespace flash::sim
