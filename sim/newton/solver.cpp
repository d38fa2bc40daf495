#include "sim/newton/solver.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "sim/newton/active_set.h"
#include "sim/newton/newton_matrix.h"
#include "sim/scene/grasp.h"
#include "sim/step/contact_set.h"
#include "sim/step/feasible_positions.h"
#include "sim/step/incremental_potential.h"
#include "sim/step/penetration.h"
#include "sim/step/way_out.h"

namespace flash::sim {

using data::Points;
using Eigen::Vector3d;

namespace {

/// A point on the way to the end of a step, always feasible.
struct Iterate {
  Points positions, force, residual;
  ContactSet contacts;
  data::SheetMaterial material;
  ElasticEnergy elastic;
  double potential = 0;
};

constexpr double rounding_tolerance = 1e-6;  ///< relative residual below which a shorter step is no help
constexpr int coupled_after = 20;            ///< iterations
constexpr int linear_problems = 6;  ///< an iteration, each with the contacts that the one before asks for
constexpr double vertex_tolerance = 30;    ///< that of a vertex over that of the sheet
constexpr double gap_tolerance = 1e-9;     ///< on gaps and complementarity [m]
constexpr double energy_tolerance = 1e-2;  ///< on energy from nothing, of what there is to turn

}  // namespace

struct Solver::Workspace {
  std::shared_ptr<const SheetPlan> plan;
  SolverSettings settings;
  NewtonMatrix matrix;
  BlockValues<double> values;
  bool refactor = true;  ///< before the next solve: the factor is missing, or of a sheet that has moved on
  // Kept between steps for their memory.
  Iterate now, trial, longer;
  ContactSet linear;
  Points gradient, force, direction;

  Workspace(std::shared_ptr<const SheetPlan> plan_in, const SolverSettings& settings_in)
      : plan(std::move(plan_in)), settings(settings_in), matrix(plan) {}
};

namespace {

/// One implicit Euler step as a problem: its potential, its contacts and the scale of its forces.
struct StepProblem {
  const BendingOperator& bending;
  IncrementalPotential potential;
  ContactStep contacts;
  double gravity;      ///< [m/s^2]; 9.81 without
  double force_scale;  ///< |M g| [N]

  StepProblem(const SheetPlan& plan, const Environment& environment, double time_step, const Exit& exit)
      : bending(
            bending_operator(plan, environment.material.bending_model, environment.material.poissons_ratio)),
        potential(plan, bending, environment, time_step),
        contacts(environment, time_step, exit),
        gravity(environment.gravity.norm() > 0 ? environment.gravity.norm() : 9.81),
        force_scale(potential.mass().norm() * gravity) {}

  void evaluate(Iterate& iterate) const {
    iterate.material = contacts.environment.material;
    iterate.potential = potential.evaluate(iterate.positions, iterate.force, iterate.elastic);
    update_contacts(contacts, iterate.positions, iterate.force, iterate.contacts);
    iterate.residual = iterate.force;
    for (const VertexConstraint& constraint : iterate.contacts.constraints)
      iterate.residual.row(constraint.vertex) -= constraint.reaction.transpose();
  }

  /// Where a vertex starts to slide under a large force, the rounding of its position turns its friction: so
  /// much more may be missing.
  bool balanced(const Iterate& iterate, double tolerance) const {
    double squared_rounding = 0;
    for (int i = 0; i < iterate.residual.rows(); ++i) {
      const VertexConstraint* c = iterate.contacts.find(i);
      const double rounding = c == nullptr ? 0
                                           : std::numeric_limits<double>::epsilon() *
                                                 iterate.positions.row(i).norm() * c->slip_stiffness.norm();
      if (!(iterate.residual.row(i).norm() <=
            vertex_tolerance * tolerance * potential.mass()[i] * gravity + rounding))
        return false;
      squared_rounding += rounding * rounding;
    }
    return iterate.residual.norm() <= tolerance * force_scale + std::sqrt(squared_rounding);
  }
};

/// Newton's method from w.now, which is feasible, to balance or to the end of its means.
void iterate_to_balance(const StepProblem& problem, Solver::Workspace& w, StepReport& report) {
  const double h = problem.contacts.time_step, tolerance = w.settings.tolerance;
  const BendingOperator& bending = problem.bending;
  const double rigidity = problem.potential.effective_rigidity();
  const bool sparse = bending.model != data::BendingModel::hinge;
  Iterate &now = w.now, &trial = w.trial, &longer = w.longer;
  longer.contacts = trial.contacts = now.contacts;
  bool stuck = false;
  int forced_moves = 0;
  while (report.iterations < w.settings.max_iterations && !problem.balanced(now, tolerance)) {
    ++report.iterations;
    if (w.refactor) {
      problem.potential.assemble(now.positions, Curvature::positive, false, w.values);
      add_bending_stand_in(bending, rigidity, w.values);
      add_slip_stiffness(now.contacts, w.values);
      restrict_matrix(w.plan->pattern, now.contacts, w.values);
      if (!w.matrix.factorize(w.values)) return;
      ++report.factorizations;
    }
    problem.potential.assemble(now.positions, stuck ? Curvature::positive : Curvature::exact, sparse,
                               w.values);
    add_slip_stiffness(now.contacts, w.values);
    if (!stuck) add_surface_curvature(now.contacts, w.values);
    w.matrix.assign(w.values, sparse, bending, rigidity, problem.potential.mass().minCoeff() / (h * h));
    // Friction at the normal forces of the iterate converges where these change little. In the parts of a
    // step that could not be solved as one it goes round in circles at times: then both at once, by the
    // residual.
    const bool coupled = !stuck && h < w.settings.time_step && report.iterations > coupled_after;
    const LinearizedAt iterate{problem.contacts, now.positions, now.force, now.residual};
    w.linear = now.contacts;
    w.gradient = now.residual;
    w.refactor = false;
    for (int solved = 0; solved < linear_problems; ++solved) {
      w.force = now.force;
      const double enough = 0.3 * tolerance * problem.force_scale;
      const int solves =
          coupled ? w.matrix.solve_coupled(w.linear, friction_couplings(problem.contacts, w.linear),
                                           w.gradient, enough, w.direction, w.force)
                  : w.matrix.solve(w.linear, w.gradient, enough, w.direction, w.force);
      report.solves += solves;
      w.refactor = w.refactor || solves > w.settings.stale_factor_solves;
      // What holds in the last one has to be what its direction was found with.
      if (solved + 1 == linear_problems) break;
      const bool changed = stuck ? hold_touching(iterate, w.direction, w.linear)
                                 : exchange_contacts(iterate, w.direction, w.force, w.gradient, w.linear);
      if (!changed) break;
    }

    // The potential guides the step; where the surface is curved or the normal forces change it is not exact,
    // and a smaller residual does as well. Near the solution the potential falls by less than its rounding.
    const auto potential_at = [&](const Iterate& at) {
      return at.potential + friction_potential(problem.contacts, now.contacts, at.positions);
    };
    const double before = potential_at(now);
    const double slope = now.residual.cwiseProduct(w.direction).sum();
    const auto move = [&](double length, Iterate& to) {
      to.positions = now.positions + length * w.direction;
      project_to_feasible(problem.contacts, w.linear, to.positions);
      problem.evaluate(to);
      return potential_at(to);
    };
    double length = 1.0, after = move(length, trial);
    const auto acceptable = [&] {
      return (!coupled && after <= before + 1e-4 * length * slope) ||
             trial.residual.norm() <= (1 - 0.1 * length) * now.residual.norm();
    };
    while (!acceptable() && length > 1e-3) after = move(length *= 0.5, trial);
    if (!acceptable() && !stuck) {
      // Once more with a fresh factor and a positive matrix, whose direction leads down.
      stuck = w.refactor = true;
      continue;
    }
    // A small step all the same lets the contacts decide anew.
    if (!acceptable() && (++forced_moves > 6 || !std::isfinite(after))) return;
    stuck = false;
    // A sheet about to buckle: the matrix, made positive, is stiffer than the sheet, and steps are too short.
    // Go on along the direction, by secants, while the potential falls.
    for (double end_slope; !coupled && length >= 1 && length < 30; std::swap(trial, longer)) {
      end_slope = trial.residual.cwiseProduct(w.direction).sum();
      if (end_slope > 0.2 * slope) break;
      length *= std::clamp(slope / (slope - end_slope), 1.5, 3.0);
      const double further = move(length, longer);
      if (further >= after || !(longer.residual.norm() < 10 * now.residual.norm())) break;
      after = further;
    }
    std::swap(now, trial);
  }
}

/// Fills in forces, contact and penetration at the end of a step.
void report_contacts(const StepProblem& problem, const Iterate& end, StepReport& report) {
  const Environment& environment = problem.contacts.environment;
  report.grasp_forces.assign(environment.grasps.size(), Vector3d::Zero());
  report.obstacle_forces.assign(environment.obstacles.size(), Vector3d::Zero());
  for (size_t k = 0; k < end.contacts.constraints.size(); ++k) {
    const VertexConstraint& c = end.contacts.constraints[k];
    if (c.hold == Hold::fixed) {
      if (c.grasp < 0) report.fixed_forces.push_back({c.vertex, c.reaction});
      if (c.grasp >= 0) report.grasp_forces[c.grasp] += c.reaction;
    }
    for (const Touch& touch : end.contacts.touches_of(k)) {
      if (!touch.holds) continue;
      report.complementarity = worst(report.complementarity, touch.gap);
      report.obstacle_forces[touch.obstacle] += touch.normal_force * touch.normal + touch.friction;
    }
  }
  for (int i = 0; i < end.positions.rows(); ++i) {
    const VertexConstraint* c = end.contacts.find(i);
    // One that is held in some axes meets no obstacle in the others: such a step is not solved.
    if (c != nullptr && c->hold == Hold::fixed && c->free.isZero(0)) continue;
    for (size_t k = 0; k < environment.obstacles.size(); ++k) {
      const Gap gap = problem.contacts.gap(static_cast<int>(k), end.positions, i);
      const double depth =
          gap.starts_inside
              ? -gap_to(environment.obstacles[k], problem.contacts.motions[k], end.positions.row(i)).distance
              : -gap.distance;
      report.penetration_max = worst(report.penetration_max, depth);
      // Where it is let out slowly it may stay below the surface.
      report.complementarity = worst(report.complementarity, -gap.distance);
    }
  }
  report.held_penetration = deepest_held(problem.contacts, end.contacts, end.positions);
  report.penetration_max = std::max(report.penetration_max, report.held_penetration.depth);
  report.start_penetration =
      deepest_at_start(problem.contacts, vertices_inside(problem.contacts, end.contacts));
}

/// Energies at the end of a step, and whether they came from somewhere: the potential of the step must not
/// end above its start value, nor the energy above that of the start and the work done.
bool account_for_energy(const StepProblem& problem, const ElasticEnergy& elastic_start, const Iterate& end,
                        StepReport& report) {
  const Environment& environment = problem.contacts.environment;
  const State& start = environment.state;
  const double h = problem.contacts.time_step;
  const Eigen::VectorXd& mass = problem.potential.mass();
  const Points moved = end.positions - start.positions;
  const auto kinetic_of = [&](const Points& velocities) {
    return 0.5 * (mass.asDiagonal() * velocities).cwiseProduct(velocities).sum();
  };
  report.kinetic = kinetic_of(moved / h);
  report.membrane = end.elastic.membrane;
  report.bending = end.elastic.bending;
  double falls = 0, unbalanced = 0;
  bool start_is_feasible = report.start_penetration.depth == 0;
  for (int i = 0; i < mass.size(); ++i) {
    const Vector3d way = moved.row(i);
    report.potential -= mass[i] * environment.gravity.dot(end.positions.row(i));
    falls += mass[i] * environment.gravity.dot(way);
    unbalanced += std::abs(end.residual.row(i).dot(way));
  }
  for (size_t k = 0; k < end.contacts.constraints.size(); ++k) {
    const VertexConstraint& c = end.contacts.constraints[k];
    const Vector3d way = moved.row(c.vertex);
    if (c.hold == Hold::fixed) {
      report.work += c.reaction.dot(way);
      start_is_feasible = start_is_feasible && ((Eigen::Matrix3d::Identity() - c.free) * way).isZero(0);
    }
    for (const Touch& touch : end.contacts.touches_of(k)) {
      if (!touch.holds) continue;
      const Vector3d force = touch.normal_force * touch.normal + touch.friction;
      // What starts inside is pushed out, also by an obstacle that stands still.
      report.work += touch.starts_inside ? std::max(0.0, force.dot(way)) : force.dot(touch.surface_moved);
    }
  }
  for (const Load& load : environment.loads) falls += load.force.dot(moved.row(load.vertex));
  for (const ObstacleMotion& motion : problem.contacts.motions)
    start_is_feasible = start_is_feasible && !motion.moves;

  const double elastic_at_start = elastic_start.membrane + elastic_start.bending,
               elastic_at_end = report.membrane + report.bending;
  const double kinetic_at_start = kinetic_of(start.velocities);
  const double gain =
      report.kinetic - kinetic_at_start + elastic_at_end - elastic_at_start - falls - report.work;
  const double there =
      kinetic_at_start + elastic_at_start + std::max(0.0, falls) + std::max(0.0, report.work);
  // Of positions, and what the weight does over a nanometre.
  const double rounding =
      1e-9 * mass.sum() * problem.gravity +
      1e-14 * environment.material.membrane_stiffness * mass.sum() / environment.material.areal_density;
  if (!(gain <= energy_tolerance * there + unbalanced + rounding)) return false;
  if (!start_is_feasible) return true;
  return end.potential <=
         problem.potential.at_start(elastic_start) + energy_tolerance * there + unbalanced + rounding;
}

/// Of the sheet at the start of the step: as a rule it is where the last step ended.
ElasticEnergy elastic_energy_at_start(const StepProblem& problem, const Solver::Workspace& w) {
  const Environment& environment = problem.contacts.environment;
  const Points& start = environment.state.positions;
  if (w.now.material == environment.material && w.now.positions.rows() == start.rows() &&
      w.now.positions == start)
    return w.now.elastic;
  Points force = Points::Zero(start.rows(), 3);
  return add_elastic_gradient(*w.plan, problem.bending, environment.material, start, force);
}

/// Whether letting the sheet out of obstacles has not torn it: edges at vertices that started inside are not
/// strained by more than what a sheet that is let go turns into the exit speed, v sqrt(rho / (E t)), nor by
/// more than they were at the start.
bool let_out_gently(const StepProblem& problem, const SheetPlan& plan,
                    const std::vector<std::vector<int>>& inside, const Points& end, double exit_speed) {
  const data::SheetMaterial& material = problem.contacts.environment.material;
  const Points& start = problem.contacts.environment.state.positions;
  const Points& rest = plan.sheet.rest.vertices;
  const double limit = exit_speed * std::sqrt(material.areal_density / material.membrane_stiffness);
  std::vector<bool> let_out(static_cast<size_t>(start.rows()), false);
  for (const std::vector<int>& vertices : inside)
    for (const int i : vertices) let_out[i] = true;
  for (size_t k = 0; k < plan.edge_count; ++k) {
    const int i = plan.pattern.pairs[k].first, j = plan.pattern.pairs[k].second;
    if (!let_out[i] && !let_out[j]) continue;
    const auto strain = [&](const Points& x) {
      return std::abs((x.row(i) - x.row(j)).norm() / (rest.row(i) - rest.row(j)).norm() - 1);
    };
    const double strain_at_end = strain(end);
    if (!(strain_at_end <= limit || strain_at_end <= strain(start))) return false;
  }
  return true;
}

/// Solves one step of `h` as a whole: w.now is its end. Returns whether it is as good as halves would be:
/// solved, or to all that rounding allows.
bool solve_step(const StepProblem& problem, Solver::Workspace& w, StepReport& report) {
  const State& start = problem.contacts.environment.state;
  const ElasticEnergy elastic_at_start = elastic_energy_at_start(problem, w);
  w.now.positions = start.positions + problem.contacts.time_step * start.velocities;
  w.now.contacts = begin_step(problem.contacts, w.now.positions);
  project_to_feasible(problem.contacts, w.now.contacts, w.now.positions);
  problem.evaluate(w.now);
  iterate_to_balance(problem, w, report);

  report.residual = w.now.residual.norm() / problem.force_scale;
  report_contacts(problem, w.now, report);
  const bool energy_is_sound = account_for_energy(problem, elastic_at_start, w.now, report);
  const bool sound = report.complementarity <= gap_tolerance && energy_is_sound;
  report.converged = sound && problem.balanced(w.now, w.settings.tolerance);
  return sound && problem.balanced(w.now, std::max(w.settings.tolerance, rounding_tolerance));
}

/// Adds the work of an attempt that was given up.
void add_work(const StepReport& given_up, StepReport& report) {
  report.iterations += given_up.iterations;
  report.solves += given_up.solves;
  report.factorizations += given_up.factorizations;
}

/// What to try for a sheet that starts inside obstacles, the fastest first: each vertex on its own side, then
/// all on one. At last it stays where it is.
std::vector<Exit> exits_of(const ContactStep& step, const std::vector<std::vector<int>>& inside) {
  const Vector3d way = common_way_out(step.environment, step.motions, inside);
  std::vector<Exit> exits;
  for (const double share : {1.0, 0.125}) {
    exits.push_back({share * step.exit.speed});
    if (!way.isZero(0)) exits.push_back({share * step.exit.speed, way});
  }
  exits.push_back({0});
  return exits;
}

/// One step of `h` as a whole; environment.state advances in any case. A sheet that starts inside obstacles
/// takes the first exit that does not tear it. Returns whether the step is solved.
bool try_step(Environment& environment, double h, Solver::Workspace& w, StepReport& report) {
  const double exit_speed = w.settings.exit_speed;
  const StepProblem problem(*w.plan, environment, h, {exit_speed});
  bool solved = solve_step(problem, w, report);
  if (report.start_penetration.depth > 0) {
    const auto inside = vertices_inside(problem.contacts, w.now.contacts);
    const std::vector<Exit> exits = exits_of(problem.contacts, inside);
    for (size_t k = 1; k < exits.size(); ++k) {
      if (solved && let_out_gently(problem, *w.plan, inside, w.now.positions, exit_speed)) break;
      // What cannot be solved costs the most, and does not get better by being slower.
      if (!solved && k > 1) k = exits.size() - 1;
      const StepReport given_up = std::exchange(report, {});
      w.refactor = true;
      solved = solve_step(StepProblem(*w.plan, environment, h, exits[k]), w, report);
      add_work(given_up, report);
    }
  }
  environment.state.time += h;
  if (!w.now.positions.allFinite()) {
    // Better a sheet that stands still, and says so, than none.
    report.residual = std::numeric_limits<double>::infinity();
    environment.state.velocities.setZero();
    report.converged = false;
    return false;
  }
  environment.state.velocities = (w.now.positions - environment.state.positions) / h;
  environment.state.positions = w.now.positions;
  return solved;
}

const Penetration& deeper(const Penetration& a, const Penetration& b) { return a.depth >= b.depth ? a : b; }

/// What two halves of a step come to.
StepReport joined(const StepReport& first, const StepReport& second) {
  StepReport whole = second;
  whole.residual = worst(first.residual, second.residual);
  whole.iterations += first.iterations;
  whole.solves += first.solves;
  whole.factorizations += first.factorizations;
  whole.substeps += first.substeps;
  whole.converged = first.converged && second.converged;
  whole.penetration_max = worst(first.penetration_max, second.penetration_max);
  whole.held_penetration = deeper(first.held_penetration, second.held_penetration);
  whole.start_penetration = first.start_penetration;
  whole.complementarity = worst(first.complementarity, second.complementarity);
  whole.work += first.work;
  for (size_t k = 0; k < whole.grasp_forces.size(); ++k)
    whole.grasp_forces[k] = 0.5 * (first.grasp_forces[k] + second.grasp_forces[k]);
  for (size_t k = 0; k < whole.obstacle_forces.size(); ++k)
    whole.obstacle_forces[k] = 0.5 * (first.obstacle_forces[k] + second.obstacle_forces[k]);
  for (size_t k = 0; k < whole.fixed_forces.size(); ++k)
    whole.fixed_forces[k].force = 0.5 * (first.fixed_forces[k].force + second.fixed_forces[k].force);
  return whole;
}

/// One step of `h`, in halves where it cannot be solved as a whole, `halvings` times still. Once a half has
/// failed the other is not divided any more: the step has not converged anyway.
StepReport advance(Environment& environment, double h, int halvings, Solver::Workspace& w) {
  const State start = environment.state;
  StepReport report;
  if (try_step(environment, h, w, report)) return report;
  w.refactor = true;
  const bool stopped = w.settings.stop != nullptr && *w.settings.stop;
  if (halvings <= 0 || stopped) return report;
  const State whole = std::exchange(environment.state, start);
  // Supports go half the way in each half.
  std::vector<Vector3d> targets;
  for (FixedVertex& support : environment.fixed) {
    targets.push_back(support.position);
    support.position = 0.5 * (support.position + start.positions.row(support.vertex).transpose());
  }
  const StepReport first = advance(environment, 0.5 * h, halvings - 1, w);
  for (size_t k = 0; k < targets.size(); ++k) environment.fixed[k].position = targets[k];
  StepReport parts = joined(first, advance(environment, 0.5 * h, first.converged ? halvings - 1 : 0, w));
  environment.state.time = whole.time;
  add_work(report, parts);
  return parts;
}

}  // namespace

Solver::Solver(std::shared_ptr<const SheetPlan> plan, const SolverSettings& settings)
    : workspace_(std::make_unique<Workspace>(std::move(plan), settings)) {}
Solver::Solver(const Sheet& sheet, const SolverSettings& settings)
    : Solver(make_sheet_plan(sheet), settings) {}
Solver::~Solver() = default;
Solver::Solver(Solver&&) noexcept = default;

StepReport Solver::step(Environment& environment) {
  Workspace& w = *workspace_;
  const double h = w.settings.time_step;
  update_grasps(environment, environment.state.time + h);
  return advance(environment, h, w.settings.halvings, w);
}

void Solver::forget() { workspace_->refactor = true; }

}  // namespace flash::sim
