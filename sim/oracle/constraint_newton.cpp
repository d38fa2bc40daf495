#include "sim/oracle/constraint_newton.h"

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

/// The rows of all contacts, tangential ones in the frame (cosine, sine) of their contact.
struct Linearisation {
  std::vector<ConstraintRow> rows;
  VectorXd cosine, sine;
  std::vector<bool> slides;
};

Linearisation linearise(const ContactProblem& problem, const ConstraintSettings& settings,
                        const VectorXd& diagonal, const VectorXd& gap, const VectorXd& multiplier) {
  const double h = problem.time_step;
  const auto normal_row = settings.complementarity == Complementarity::fischer_burmeister
                              ? normal_row_fischer_burmeister
                              : normal_row_minimum_map;
  const Index contacts = problem.friction.size();
  Linearisation at{{}, VectorXd::Ones(contacts), VectorXd::Zero(contacts), std::vector<bool>(contacts)};
  at.rows.reserve(gap.size());
  for (Index k = 0; k < contacts; ++k) {
    const double* c = &gap[3 * k];
    const double* l = &multiplier[3 * k];
    const double tangential = 0.5 * (diagonal[3 * k + 1] + diagonal[3 * k + 2]);
    at.rows.push_back(normal_row(c[0], c[0], l[0], h * h * diagonal[3 * k], h));
    if (settings.friction == FrictionRow::newton) {
      const SlipRows t = slip_rows(c + 1, c + 1, l + 1, l[0], problem.friction[k], h * h * tangential, h);
      at.rows.push_back(t.along);
      at.rows.push_back(t.across);
      at.cosine[k] = t.direction[0];
      at.sine[k] = t.direction[1];
      at.slides[k] = t.along.omega == 0;
    } else {
      const FrictionRows t = friction_rows(c + 1, c + 1, l + 1, l[0], problem.friction[k], h * tangential, h);
      at.rows.push_back({t.omega, t.compliance, t.rhs[0]});
      at.rows.push_back({t.omega, t.compliance, t.rhs[1]});
    }
  }
  return at;
}

/// Tangential rows of x from the contacts' bases into the frames of their rows (direction 1) or back (-1).
template <typename Matrix>
void turn(const Linearisation& at, int direction, Matrix&& x) {
  for (Index k = 0; k < at.cosine.size(); ++k) {
    if (at.sine[k] == 0 && at.cosine[k] == 1) continue;
    const double c = at.cosine[k], s = direction * at.sine[k];
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
    step = solve_dual(W, at.rows, problem.time_step, settings);
  } else {
    const Operator turned = [&](const VectorXd& l, VectorXd& w) {
      VectorXd own = l;
      turn(at, -1, own);
      problem.apply_W(own, w);
      turn(at, 1, w);
    };
    step = solve_dual(turned, diagonal, at.rows, problem.time_step, settings);
  }
  turn(at, -1, step.x);
  return step;
}

/// Sliding contacts follow their normal force to the new rim of the disc, which the frozen one has missed.
void follow_rim(const ContactProblem& problem, const Linearisation& at, VectorXd& multiplier) {
  for (Index k = 0; k < problem.friction.size(); ++k) {
    const double limit = problem.friction[k] * std::max(multiplier[3 * k], 0.0);
    const double size = multiplier.segment<2>(3 * k + 1).norm();
    if (at.slides[k] && size > 0) multiplier.segment<2>(3 * k + 1) *= limit / size;
  }
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
      follow_rim(problem, at, trial);
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
