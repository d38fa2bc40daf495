#include "sim/solver.h"

#include <algorithm>
#include <cmath>

#include "sim/elastic_energy.h"
#include "sim/grasp.h"
#include "sim/newton_matrix.h"
#include "sim/vertex_constraint.h"

namespace flash::sim {

using data::Points;
using Eigen::Map;
using Eigen::Matrix3d;
using Eigen::Vector3d;

struct Solver::Workspace {
  std::shared_ptr<const SheetPlan> plan;
  SolverSettings settings;
  NewtonMatrix matrix;
  BlockValues<double> values, damping;
  bool refactor = true;  ///< before the next solve: the factor is missing, or of a sheet that has moved on

  Workspace(std::shared_ptr<const SheetPlan> plan_in, const SolverSettings& settings_in)
      : plan(std::move(plan_in)), settings(settings_in), matrix(plan) {}
};

namespace {

/// The incremental potential of one implicit Euler step and what it is made of.
class StepProblem {
 public:
  StepProblem(const SheetPlan& plan, const BendingOperator& bending, const Environment& environment,
              double time_step, const BlockValues<double>& damping)
      : plan_(plan), bending_(bending), environment_(environment), h_(time_step), damping_(damping) {
    const State& start = environment.state;
    mass_ = environment.material.areal_density * plan.sheet.vertex_area;
    target_ = start.positions + h_ * start.velocities;
    target_.rowwise() += h_ * h_ * environment.gravity.transpose();
    loads_ = Points::Zero(start.positions.rows(), 3);
    for (const Load& load : environment.loads) loads_.row(load.vertex) += load.force.transpose();
  }

  const Eigen::VectorXd& mass() const { return mass_; }

  /// Potential [J] at `positions`; `force` becomes its gradient: what every vertex needs from outside [N].
  double evaluate(const Points& positions, Points& force, ElasticEnergy& elastic) const {
    const Points inertial = positions - target_, moved = positions - environment_.state.positions;
    const double drag = environment_.material.air_drag / h_;
    force = mass_.asDiagonal() * (inertial / (h_ * h_) + drag * moved) - loads_;
    double potential = 0.5 / (h_ * h_) * (mass_.asDiagonal() * inertial).cwiseProduct(inertial).sum() +
                       0.5 * drag * (mass_.asDiagonal() * moved).cwiseProduct(moved).sum() -
                       loads_.cwiseProduct(moved).sum();
    if (!damping_.empty()) {
      Points damped = Points::Zero(moved.rows(), 3);
      add_block_product(plan_.pattern, damping_, 1.0, moved, damped);
      force += damped;
      potential += 0.5 * damped.cwiseProduct(moved).sum();
    }
    elastic = add_elastic_gradient(plan_, bending_, environment_.material, positions, force);
    return potential + elastic.membrane + elastic.bending;
  }

  /// Hessian of the potential, without the stiffness of a quadratic bending model.
  /// `sparse`: over edges alone.
  void assemble(const Points& positions, Curvature curvature, bool sparse,
                BlockValues<double>& values) const {
    if (damping_.empty())
      values.assign(9 * (plan_.pattern.size + (sparse ? plan_.edge_count : plan_.pattern.pairs.size())), 0.0);
    else
      values = damping_;
    add_elastic_hessian(plan_, bending_, environment_.material, positions, 1.0, curvature, values);
    const double per_mass = 1 / (h_ * h_) + environment_.material.air_drag / h_;
    for (int i = 0; i < plan_.pattern.size; ++i)
      for (int c = 0; c < 3; ++c) values[9L * i + 4 * c] += mass_[i] * per_mass;
  }

 private:
  const SheetPlan& plan_;
  const BendingOperator& bending_;
  const Environment& environment_;
  double h_;
  const BlockValues<double>& damping_;
  Eigen::VectorXd mass_;
  Points target_, loads_;
};

/// A point on the way to the end of a step, always feasible.
struct Iterate {
  Points positions, force, residual;
  std::vector<VertexConstraint> constraints;
  ElasticEnergy elastic;
  double potential = 0;
};

/// The friction force of a slipping vertex turns with its slip.
void add_slip_stiffness(const std::vector<VertexConstraint>& constraints, BlockValues<double>& values) {
  for (size_t i = 0; i < constraints.size(); ++i) {
    const VertexConstraint& c = constraints[i];
    if (c.slip_stiffness == 0) continue;
    Map<Matrix3d> block(values.data() + 9 * i);
    block += c.slip_stiffness * c.free *
             (Matrix3d::Identity() - c.slip_direction * c.slip_direction.transpose()) * c.free;
  }
}

/// A vertex that slides over a round surface turns its normal force: the Hessian of the gap times -lambda_n.
void add_surface_curvature(const std::vector<VertexConstraint>& constraints, BlockValues<double>& values) {
  for (size_t i = 0; i < constraints.size(); ++i)
    for (const Touch& touch : constraints[i].touches)
      if (touch.holds)
        Map<Matrix3d>(values.data() + 9 * i) -= touch.normal_force * touch.curved * touch.curved.transpose();
}

/// P B P + (I - P) scaled to its neighbours: the matrix of the free directions.
void restrict_matrix(const BlockPattern& pattern, const std::vector<VertexConstraint>& constraints,
                     BlockValues<double>& values) {
  const auto block = [&](size_t k) { return Map<Matrix3d>(values.data() + 9 * k); };
  const auto is_free = [&](int i) { return constraints[i].hold == Hold::free; };
  for (int i = 0; i < pattern.size; ++i) {
    if (is_free(i)) continue;
    const Matrix3d& P = constraints[i].free;
    block(i) = P * block(i) * P + block(i).trace() / 3 * (Matrix3d::Identity() - P);
  }
  for (size_t k = 0; k < pattern.pairs.size(); ++k) {
    const auto [row, column] = pattern.pairs[k];
    if (is_free(row) && is_free(column)) continue;
    auto b = block(pattern.size + k);
    b = constraints[row].free * b * constraints[column].free;
  }
}

/// Frees a vertex from the touches that would have to pull. Returns whether from any.
bool release(const Vector3d& force, VertexConstraint& c) {
  const std::array<bool, 2> held = {c.touches[0].holds, c.touches[1].holds};
  const std::array<double, 2> normal = normal_forces(c.touches, held, force);
  bool any = false;
  for (int k = 0; k < 2; ++k) {
    any = any || (held[k] && normal[k] == 0);
    c.touches[k].holds = held[k] && normal[k] > 0;
  }
  if (!any) return false;
  const bool still_held = c.touches[0].holds || c.touches[1].holds;
  c.hold = still_held ? Hold::slip : Hold::free;
  c.free = still_held ? along_surfaces(c.touches) : Matrix3d(Matrix3d::Identity());
  c.correction -= c.free * c.correction;
  return true;
}

/// Holds a vertex on the touches that `step` drives it into. Returns whether on any.
bool hold(const Vector3d& step, VertexConstraint& c) {
  bool any = false;
  for (int k = 0; k < 2; ++k) {
    Touch& touch = c.touches[k];
    const Touch& other = c.touches[1 - k];
    if (touch.obstacle < 0 || touch.holds || touch.gap + touch.normal.dot(step) >= -1e-12) continue;
    const double missing = -touch.gap - touch.normal.dot(c.correction);
    if (other.holds) {
      // Within the surface that holds already, up to the edge.
      const Vector3d inward = touch.normal - other.normal * other.normal.dot(touch.normal);
      if (inward.squaredNorm() < 1e-6) continue;
      c.correction += missing / inward.squaredNorm() * inward;
    } else {
      c.correction += missing * touch.normal;
    }
    touch.holds = true;
    c.hold = Hold::slip;
    c.free = along_surfaces(c.touches);
    any = true;
  }
  return any;
}

/// One exchange of the active set of the linear problem: holds vertices that `direction` drives into a
/// surface and frees those that the surface would have to pull (`force`: what they would need at its end).
/// Returns whether any.
bool exchange_contacts(const Points& direction, const Points& force_before, const Points& force,
                       Points& gradient, std::vector<VertexConstraint>& constraints) {
  bool any = false;
  for (size_t i = 0; i < constraints.size(); ++i) {
    VertexConstraint& c = constraints[i];
    if (c.hold == Hold::fixed || c.touches[0].obstacle < 0) continue;
    if (c.hold != Hold::free && release(force.row(i), c)) {
      gradient.row(i) = force_before.row(i);
      any = true;
    } else if (c.hold != Hold::stick && hold(direction.row(i), c)) {
      any = true;
    }
  }
  return any;
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
  const State& start = environment.state;
  const double time = start.time + h;
  const BendingOperator& bending =
      bending_operator(*w.plan, environment.material.bending_model, environment.material.poissons_ratio);
  const double rigidity = environment.material.bending_rigidity;
  update_grasps(environment, time);

  w.damping.clear();
  if (environment.material.stiffness_damping > 0) {
    w.damping.assign(9 * (w.plan->pattern.size + w.plan->pattern.pairs.size()), 0.0);
    add_elastic_hessian(*w.plan, bending, environment.material, start.positions,
                        environment.material.stiffness_damping / h, Curvature::positive, w.damping);
    add_bending_stand_in(bending, environment.material.stiffness_damping / h * rigidity, w.damping);
  }
  const StepProblem problem(*w.plan, bending, environment, h, w.damping);
  const double gravity = environment.gravity.norm() > 0 ? environment.gravity.norm() : 9.81;
  const double force_scale = problem.mass().norm() * gravity;

  const bool sparse = w.damping.empty() && bending.model != data::BendingModel::hinge;
  StepReport report;
  Iterate now, trial, longer;
  const auto evaluate = [&](Iterate& iterate) {
    iterate.potential = problem.evaluate(iterate.positions, iterate.force, iterate.elastic);
    update_contacts(environment, time, h, iterate.positions, iterate.force, iterate.constraints);
    iterate.residual = iterate.force;
    for (int i = 0; i < iterate.residual.rows(); ++i)
      iterate.residual.row(i) -= iterate.constraints[i].reaction.transpose();
  };
  now.positions = start.positions + h * start.velocities;
  now.constraints = begin_step(environment, time, now.positions);
  evaluate(now);
  longer.constraints = trial.constraints = now.constraints;
  // The linear problem's own; kept between iterations for their memory.
  std::vector<VertexConstraint> linear;
  Points gradient, force, direction;
  bool stuck = false;
  int forced_moves = 0;
  while (report.iterations < w.settings.max_iterations &&
         now.residual.norm() > w.settings.tolerance * force_scale) {
    ++report.iterations;
    if (w.refactor) {
      problem.assemble(now.positions, Curvature::positive, false, w.values);
      add_bending_stand_in(bending, rigidity, w.values);
      add_slip_stiffness(now.constraints, w.values);
      restrict_matrix(w.plan->pattern, now.constraints, w.values);
      if (!w.matrix.factorize(w.values)) break;
      ++report.factorizations;
    }
    problem.assemble(now.positions, stuck ? Curvature::positive : Curvature::exact, sparse, w.values);
    add_slip_stiffness(now.constraints, w.values);
    if (!stuck) add_surface_curvature(now.constraints, w.values);
    w.matrix.assign(w.values, sparse, bending, rigidity, problem.mass().minCoeff() / (h * h));
    linear = now.constraints;
    gradient = now.residual;
    for (int exchange = 0; exchange < 6; ++exchange) {
      force = now.force;
      const int solves =
          w.matrix.solve(linear, gradient, 0.3 * w.settings.tolerance * force_scale, direction, force);
      report.solves += solves;
      w.refactor = solves > w.settings.stale_factor_solves;
      if (!exchange_contacts(direction, now.force, force, gradient, linear)) break;
    }

    // The potential guides the step; where the surface is curved or the normal forces change it is not exact,
    // and a smaller residual does as well. Near the solution the potential falls by less than its rounding.
    const double before =
        now.potential + friction_potential(environment, time, h, now.constraints, now.positions);
    const double slope = now.residual.cwiseProduct(direction).sum();
    const auto move = [&](double length, Iterate& to) {
      to.positions = now.positions + length * direction;
      project_to_feasible(environment, time, h, linear, to.positions);
      evaluate(to);
      return to.potential + friction_potential(environment, time, h, now.constraints, to.positions);
    };
    double length = 1.0, after = move(length, trial);
    const auto acceptable = [&] {
      return after <= before + 1e-4 * length * slope ||
             trial.residual.norm() <= (1 - 0.1 * length) * now.residual.norm();
    };
    while (!acceptable() && length > 1e-3) after = move(length *= 0.5, trial);
    if (!acceptable() && !stuck) {
      // Once more with a fresh factor and a positive matrix, whose direction leads down.
      stuck = w.refactor = true;
      continue;
    }
    // A small step all the same lets the contacts decide anew.
    if (!acceptable() && (++forced_moves > 6 || !std::isfinite(after))) break;
    stuck = false;
    // A sheet about to buckle: the matrix, made positive, is stiffer than the sheet, and steps are too short.
    // Go on along the direction, by secants, while the potential falls.
    for (double end_slope; length >= 1 && length < 30; std::swap(trial, longer)) {
      end_slope = trial.residual.cwiseProduct(direction).sum();
      if (end_slope > 0.2 * slope) break;
      length *= std::clamp(slope / (slope - end_slope), 1.5, 3.0);
      const double further = move(length, longer);
      if (further >= after || !(longer.residual.norm() < 10 * now.residual.norm())) break;
      after = further;
    }
    std::swap(now, trial);
  }
  report.residual = now.residual.norm() / force_scale;
  report.converged = report.residual <= w.settings.tolerance;

  report.membrane = now.elastic.membrane;
  report.bending = now.elastic.bending;
  report.grasp_forces.assign(environment.grasps.size(), Vector3d::Zero());
  report.obstacle_forces.assign(environment.obstacles.size(), Vector3d::Zero());
  for (size_t i = 0; i < now.constraints.size(); ++i) {
    const VertexConstraint& c = now.constraints[i];
    for (const Touch& touch : c.touches)
      report.penetration_max = std::max(report.penetration_max, -touch.gap);
    if (c.hold == Hold::fixed) {
      if (c.grasp < 0) report.fixed_forces.push_back({int(i), c.reaction});
      if (c.grasp >= 0) report.grasp_forces[c.grasp] += c.reaction;
      continue;
    }
    for (const Touch& touch : c.touches) {
      if (!touch.holds) continue;
      report.complementarity = std::max(report.complementarity, std::abs(touch.gap));
      report.obstacle_forces[touch.obstacle] += force_from(environment, c, touch);
    }
  }
  environment.state.velocities = (now.positions - start.positions) / h;
  environment.state.positions = now.positions;
  environment.state.time = time;
  const Eigen::VectorXd& mass = problem.mass();
  report.kinetic =
      0.5 *
      (mass.asDiagonal() * environment.state.velocities).cwiseProduct(environment.state.velocities).sum();
  report.potential = 0;
  for (int i = 0; i < mass.size(); ++i)
    report.potential -= mass[i] * environment.gravity.dot(now.positions.row(i));
  return report;
}

}  // namespace flash::sim
