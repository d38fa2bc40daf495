#include "sim/constraint_newton.h"

#include <algorithm>
#include <cmath>

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
  const double h2 = problem.time_step * problem.time_step;
  double sum = 0;
  worst = 0;
  for (Index k = 0; k < problem.friction.size(); ++k) {
    const double* c = &gap[3 * k];
    const double* l = &multiplier[3 * k];
    const double r_t = 0.5 * h2 * (diagonal[3 * k + 1] + diagonal[3 * k + 2]);
    const double normal = normal_violation(c[0], l[0], h2 * diagonal[3 * k]);
    const double tangential = friction_violation(c + 1, l + 1, l[0], problem.friction[k], r_t);
    sum += normal * normal + tangential * tangential;
    worst = std::max({worst, normal, tangential});
  }
  return sum;
}

std::vector<ConstraintRow> rows_at(const ContactProblem& problem, Complementarity complementarity,
                                   const VectorXd& diagonal, const VectorXd& gap,
                                   const VectorXd& multiplier) {
  const double h = problem.time_step;
  const auto normal_row = complementarity == Complementarity::fischer_burmeister
                              ? normal_row_fischer_burmeister
                              : normal_row_minimum_map;
  std::vector<ConstraintRow> rows;
  rows.reserve(gap.size());
  for (Index k = 0; k < problem.friction.size(); ++k) {
    const double* c = &gap[3 * k];
    const double* l = &multiplier[3 * k];
    const double r_t = 0.5 * h * (diagonal[3 * k + 1] + diagonal[3 * k + 2]);
    rows.push_back(normal_row(c[0], c[0], l[0], h * h * diagonal[3 * k], h));
    const FrictionRows t = friction_rows(c + 1, c + 1, l + 1, l[0], problem.friction[k], r_t, h);
    rows.push_back({t.omega, t.compliance, t.rhs[0]});
    rows.push_back({t.omega, t.compliance, t.rhs[1]});
  }
  return rows;
}

void project(const ContactProblem& problem, double max_force, VectorXd& multiplier) {
  for (Index k = 0; k < problem.friction.size(); ++k) {
    multiplier[3 * k] = std::clamp(multiplier[3 * k], 0.0, max_force);
    project_on_disc(&multiplier[3 * k + 1], multiplier[3 * k], problem.friction[k]);
  }
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
    const auto rows = rows_at(problem, settings.complementarity, diagonal, gap, multiplier);
    const DualSolution step =
        problem.W.size() > 0
            ? solve_dual(problem.W, rows, problem.time_step, settings.linear)
            : solve_dual(problem.apply_W, diagonal, rows, problem.time_step, settings.linear);
    ++report.iterations;
    report.linear_iterations += step.iterations;
    const VectorXd start = multiplier;
    double accepted = -1;
    const double first = settings.damping > 0 ? settings.damping : 1.0;
    const double last = settings.damping > 0 ? settings.damping : 0.125;
    for (double length = first; length >= last; length *= 0.5) {
      VectorXd trial = start + length * step.x;
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
