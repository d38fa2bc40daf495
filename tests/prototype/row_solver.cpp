#include "tests/prototype/row_solver.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include "sim/newton/active_set.h"
#include "sim/step/feasible_positions.h"

namespace flash::sim {

using data::Points;

namespace {

constexpr int most_portions = 20, portion_iterations = 5;  ///< as in Solver
constexpr int most_updates = 30;          ///< of multipliers in a step, by the augmented Lagrangian
constexpr double enough_progress = 0.25;  ///< of the violation by an update, without which the penalty grows
constexpr double penalty_growth = 4;
constexpr double greatest_penalty = 1e4;  ///< over the first
constexpr double crushed_share = 1e-6;    ///< of the thickness, as in Solver
constexpr double kept_share = 0.5;  ///< of the thickness, below which no iteration with rows takes features

/// The stiffness of all touches but what presses rows.
std::vector<TouchStiffness> stiffness_beside_rows(const StepProblem& problem, const Iterate& iterate) {
  std::vector<TouchStiffness> all;
  for (const LayerTouch& touch : iterate.layers.touches) {
    LayerTouch rubbing = touch;
    if (is_row(touch)) rubbing.stiffness = 0;
    all.push_back({touch, stiffness_of(rubbing, problem.layers->friction(), problem.layers->time_step())});
  }
  return all;
}

}  // namespace

RowSolver::RowSolver(const Sheet& sheet, RowMethod method, const SolverSettings& settings)
    : method_(method), w_(make_sheet_plan(sheet), settings), matrix_(w_.plan) {
  w_.layers.emplace(sheet);
}

StepReport RowSolver::step(Environment& environment) {
  update_holds(environment, environment.state.time + w_.settings.time_step);
  const SelfContact contact = *environment.self_contact;
  thickness_ = contact.thickness;
  environment.self_contact->thickness = row_reach * thickness_;
  const StepReport report = advance(environment, w_.settings.time_step, w_.settings.halvings);
  environment.self_contact = contact;
  return report;
}

StepReport RowSolver::advance(Environment& environment, double h, int halvings) {
  const State start = environment.state;
  const PairMultipliers multipliers = multipliers_;
  StepReport report;
  if (try_step(environment, h, report)) return report;
  w_.refactor = true;
  // Shorter steps do not help layers that are crushed, as in Solver.
  if (halvings <= 0 || report.layer_distance < crushed_share * thickness_) return report;
  const double end = std::exchange(environment.state, start).time;
  multipliers_ = multipliers;
  const StepReport first = advance(environment, 0.5 * h, halvings - 1);
  StepReport parts = joined(first, advance(environment, 0.5 * h, first.converged ? halvings - 1 : 0));
  environment.state.time = end;
  add_work(report, parts);
  return parts;
}

bool RowSolver::try_step(Environment& environment, double h, StepReport& report) {
  StepProblem problem(*w_.plan, environment, h, {.speed = w_.settings.exit_speed},
                      w_.layers ? &*w_.layers : nullptr);
  problem.layers = std::make_unique<RowLayers>(*problem.layers, multipliers_);
  multipliers_.penalty = first_penalty(problem);

  bool free = start_search(problem);
  for (int portion = 0; !free && portion < most_portions; ++portion) {
    balance(problem, portion_iterations, report);
    free = carry_on(problem, w_, report);
  }
  balance(problem, w_.settings.max_iterations, report);

  report.residual = problem.relative_residual(w_.now);
  report_contacts(problem, w_.now, report);
  report.converged = free && report.complementarity <= gap_tolerance && solved(problem);
  update_multipliers(w_.now.layers, multipliers_);

  environment.state.time += h;
  environment.state.velocities = (w_.now.positions - environment.state.positions) / h;
  environment.state.bristles = bristles_at_end(problem.contacts, w_.now.contacts, w_.now.positions);
  environment.state.pair_bristles = problem.layers->bristles_at_end(w_.now.layers);
  environment.state.positions = w_.now.positions;
  return report.converged;
}

double RowSolver::first_penalty(const StepProblem& problem) const {
  const double stiffness = problem.contacts.environment.self_contact->pressure / thickness_;
  if (method_ == RowMethod::augmented) return stiffness;
  const std::vector<double>& area = w_.layers->surface.vertex_area;
  const double h = problem.contacts.time_step;
  return problem.potential.mass().sum() / std::accumulate(area.begin(), area.end(), 0.0) / (h * h);
}

bool RowSolver::start_search(const StepProblem& problem) {
  constexpr int most_cuts = 8;
  const State& start = problem.contacts.environment.state;
  double part = 1, share = 0;
  for (int cut = 0; cut <= most_cuts && share < 1; ++cut) {
    if (cut == most_cuts) part = 0;
    w_.now.positions = start.positions + part * problem.contacts.time_step * start.velocities;
    w_.now.contacts = begin_step(problem.contacts, w_.now.positions);
    project_to_feasible(problem.contacts, w_.now.contacts, w_.now.positions);
    share = problem.layers->free_share(start.positions, w_.now.positions);
    part *= share;
  }
  if (share < 1) w_.now.positions = start.positions;
  problem.evaluate(w_.now);
  return share == 1;
}

bool RowSolver::solved(const StepProblem& problem, double share) const {
  return problem.balanced(w_.now, share * w_.settings.tolerance) &&
         row_violation(w_.now.layers, multipliers_) <= row_tolerance * thickness_;
}

void RowSolver::balance(const StepProblem& problem, int most_iterations, StepReport& report) {
  if (method_ == RowMethod::augmented)
    augment(problem, most_iterations, report);
  else
    iterate_with_rows(problem, most_iterations, report);
}

void RowSolver::augment(const StepProblem& problem, int most_iterations, StepReport& report) {
  const double greatest = greatest_penalty * multipliers_.penalty;
  double before = 1e300;
  for (int update = 0; update < most_updates; ++update) {
    iterate_to_balance(problem, most_iterations, w_, report);
    const double violation = row_violation(w_.now.layers, multipliers_);
    if (solved(problem) || !problem.balanced(w_.now, w_.settings.tolerance)) return;
    update_multipliers(w_.now.layers, multipliers_);
    if (violation > enough_progress * before)
      multipliers_.penalty = std::min(greatest, penalty_growth * multipliers_.penalty);
    before = violation;
    problem.evaluate(w_.now);
  }
}

bool RowSolver::factorize(const StepProblem& problem) {
  problem.potential.assemble(w_.now.positions, Curvature::positive, false, w_.values);
  for (const BodyLaw& law : problem.laws)
    add_bending_stand_in(law.bending, problem.potential.effective_rigidity(law), w_.values);
  add_slip_stiffness(w_.now.contacts, w_.values);
  for (const TouchStiffness& layer : stiffness_beside_rows(problem, w_.now))
    for (int k = 0; k < 4; ++k)
      Eigen::Map<Eigen::Matrix3d>(w_.values.data() + 9L * layer.touch.vertices[k]) +=
          layer.touch.weights[k] * layer.touch.weights[k] * matrix3d(layer.stiffness);
  restrict_matrix(w_.plan->pattern, w_.now.contacts, w_.values);
  return matrix_.factorize(w_.values);
}

void RowSolver::assemble(const StepProblem& problem) {
  bool sparse = true;
  std::vector<ScaledBending> bending;
  for (const BodyLaw& law : problem.laws) {
    if (law.solid != nullptr) continue;
    sparse = sparse && !law.bends_at_hinges();
    bending.push_back({law.bending, problem.potential.effective_rigidity(law)});
  }
  problem.potential.assemble(w_.now.positions, Curvature::exact, sparse, w_.values);
  add_slip_stiffness(w_.now.contacts, w_.values);
  add_surface_curvature(w_.now.contacts, w_.values);
  const double row_stiffness = problem.contacts.environment.self_contact->pressure / thickness_;
  std::vector<ContactRow> rows;
  for (const LayerTouch& touch : w_.now.layers.touches) {
    if (!is_row(touch)) continue;
    const double p = multipliers_.of(key_of(touch.kind, touch.vertices));
    const double pressed = pressure_of(touch, multipliers_.penalty);
    rows.push_back({touch, touch.normal - problem.layers->friction() * touch.slip_direction,
                    (pressed - p) / multipliers_.penalty,
                    multipliers_.penalty / (row_stiffness * touch.stiffness)});
  }
  matrix_.assign(w_.values, sparse, bending, stiffness_beside_rows(problem, w_.now), std::move(rows));
}

void RowSolver::solve_rows(const StepProblem& problem, StepReport& report) {
  const Linearization iterate{problem.contacts, w_.now.positions, w_.now.force, w_.now.residual};
  w_.linear = w_.now.contacts;
  w_.gradient = w_.now.residual;
  w_.refactor = false;
  for (int solved = 0; solved < linear_problems; ++solved) {
    w_.force = w_.now.force;
    const int solves = matrix_.solve(w_.linear, friction_couplings(problem.contacts, w_.linear), w_.gradient,
                                     w_.direction, forces_, w_.force);
    report.solves += solves;
    w_.refactor = w_.refactor || solves > w_.settings.stale_factor_solves;
    if (solved + 1 == linear_problems ||
        !exchange_contacts(iterate, w_.direction, w_.force, w_.gradient, w_.linear))
      return;
  }
}

double RowSolver::move(const StepProblem& problem) {
  constexpr int most_cuts = 20;
  const PairMultipliers from = multipliers_;
  const double least = std::min(kept_share * thickness_, w_.now.layers.closest);
  double length = 1;
  for (int cut = 0;; ++cut) {
    if (cut == most_cuts) length = 0;
    w_.trial.positions = w_.now.positions + length * w_.direction;
    project_to_feasible(problem.contacts, w_.linear, w_.trial.positions);
    const double share = problem.layers->free_share(w_.now.positions, w_.trial.positions);
    if (share < 1 && cut < most_cuts) {
      length *= share;
      continue;
    }
    // Multipliers go on as far as the vertices do; those that do not press go to zero.
    multipliers_.pressure.clear();
    long row = 0;
    for (const LayerTouch& touch : w_.now.layers.touches) {
      const PairKey key = key_of(touch.kind, touch.vertices);
      const double before = from.of(key), pressed = pressure_of(touch, from.penalty);
      const double after = is_row(touch) ? pressed * (1 + forces_[row++] / touch.normal_force) : 0;
      multipliers_.pressure[key] = before + length * (after - before);
    }
    problem.evaluate(w_.trial);
    if (w_.trial.layers.closest >= least || cut >= most_cuts) return length;
    length *= 0.5;
  }
}

void RowSolver::iterate_with_rows(const StepProblem& problem, int most_iterations, StepReport& report) {
  w_.trial.contacts = w_.now.contacts;
  double share = start_tolerance_share;
  for (int k = 0; k < most_iterations && !solved(problem, share); ++k) {
    share = 1;
    ++report.iterations;
    if (w_.refactor) {
      if (!factorize(problem)) return;
      ++report.factorizations;
    }
    assemble(problem);
    solve_rows(problem, report);
    const double length = move(problem);
    problem.layers->carry_duals(w_.now.layers, length, w_.trial.layers);
    std::swap(w_.now, w_.trial);
    if (!w_.now.residual.allFinite()) return;
  }
}

}  // namespace flash::sim
