#include "sim/solver.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "sim/elastic_energy.h"
#include "sim/vertex_constraint.h"

namespace flash::sim {

namespace {

using data::Points;
using Eigen::Map;
using Eigen::Matrix3d;
using Eigen::RowVector3d;
using Eigen::Vector3d;

/// Closes and opens grasps for the step that ends at `time`.
void update_grasps(Environment& environment, double time) {
  auto& offsets = environment.state.grasp_offsets;
  offsets.resize(environment.grasps.size());
  for (size_t k = 0; k < environment.grasps.size(); ++k) {
    const Grasp& grasp = environment.grasps[k];
    const bool closed = environment.state.time >= grasp.from - 1e-9 && time <= grasp.to + 1e-9;
    if (!closed) {
      offsets[k].resize(0, 3);
    } else if (offsets[k].rows() == 0) {
      const Eigen::Isometry3d gripper = data::pose_at(grasp.gripper, environment.state.time).inverse();
      offsets[k].resize(grasp.vertices.size(), 3);
      for (size_t v = 0; v < grasp.vertices.size(); ++v)
        offsets[k].row(v) = gripper * environment.state.positions.row(grasp.vertices[v]).transpose();
    }
  }
}

}  // namespace

struct Solver::Workspace {
  std::shared_ptr<const SheetPlan> plan;
  SolverSettings settings;
  std::map<std::pair<data::BendingModel, double>, std::shared_ptr<const BendingOperator>> bending;
  BlockCholesky<double> factor;
  BlockValues<double> values, damping;
  bool refactor = true;  ///< before the next solve: the factor is missing, or of a sheet that has moved on

  Workspace(std::shared_ptr<const SheetPlan> plan_in, const SolverSettings& settings_in)
      : plan(std::move(plan_in)), settings(settings_in), factor(plan->symbolic) {}

  const BendingOperator& bending_of(const data::SheetMaterial& material);

  /// Conjugate gradients on the free directions. The matrix has the bending operator itself and the
  /// constraints of this iterate; the factor that preconditions it has the operator's stand-in, and may be of
  /// an earlier iterate. Returns the number of iterations, 0 where the matrix could not be factorized.
  int solve(const BendingOperator& operator_, double bending_rigidity,
            const std::vector<VertexConstraint>& constraints, const Points& right_hand_side, double tolerance,
            Points& solution);
};

const BendingOperator& Solver::Workspace::bending_of(const data::SheetMaterial& material) {
  const bool depends_on_nu = material.bending_model == data::BendingModel::plate;
  auto& entry = bending[{material.bending_model, depends_on_nu ? material.poissons_ratio : 0.0}];
  if (!entry) entry = make_bending_operator(*plan, material.bending_model, material.poissons_ratio);
  return *entry;
}

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
                       loads_.cwiseProduct(positions).sum();
    if (!damping_.empty()) {
      Points damped = Points::Zero(moved.rows(), 3);
      add_block_product(plan_.pattern, damping_, 1.0, moved, damped);
      force += damped;
      potential += 0.5 * damped.cwiseProduct(moved).sum();
    }
    elastic = add_elastic_gradient(plan_, bending_, environment_.material, positions, force);
    return potential + elastic.membrane + elastic.bending;
  }

  /// A positive definite stand-in for the Hessian of the potential.
  void assemble(const Points& positions, BlockValues<double>& values) const {
    values.assign(9 * (plan_.pattern.size + plan_.pattern.pairs.size()), 0.0);
    if (!damping_.empty()) values = damping_;
    add_elastic_hessian(plan_, bending_, environment_.material, positions, 1.0, values);
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

/// Turns the matrix into that of the free directions, P (B + friction) P + (I - P) scaled to its neighbours.
void constrain(const BlockPattern& pattern, const std::vector<VertexConstraint>& constraints,
               BlockValues<double>& values) {
  const auto block = [&](size_t k) { return Map<Matrix3d>(values.data() + 9 * k); };
  for (int i = 0; i < pattern.size; ++i) {
    const VertexConstraint& c = constraints[i];
    if (c.hold == Hold::free) continue;
    const Matrix3d friction =
        c.slip_stiffness * (Matrix3d::Identity() - c.slip_direction * c.slip_direction.transpose());
    const double scale = block(i).trace() / 3;
    block(i) = c.free * (block(i) + friction) * c.free + scale * (Matrix3d::Identity() - c.free);
  }
  for (size_t k = 0; k < pattern.pairs.size(); ++k) {
    const auto [row, column] = pattern.pairs[k];
    if (constraints[row].hold == Hold::free && constraints[column].hold == Hold::free) continue;
    auto b = block(pattern.size + k);
    b = constraints[row].free * b * constraints[column].free;
  }
}

void restrict_to_free(const std::vector<VertexConstraint>& constraints, Points& vectors) {
  for (size_t i = 0; i < constraints.size(); ++i)
    if (constraints[i].hold != Hold::free) vectors.row(i) *= constraints[i].free;
}

}  // namespace

int Solver::Workspace::solve(const BendingOperator& operator_, double bending_rigidity,
                             const std::vector<VertexConstraint>& constraints, const Points& right_hand_side,
                             double tolerance, Points& solution) {
  if (refactor && !factor.factorize(values)) return 0;
  Points residual = right_hand_side, product(residual.rows(), 3), preconditioned, search;
  restrict_to_free(constraints, residual);
  solution.setZero(residual.rows(), 3);
  const double target = std::max(0.05 * residual.norm(), tolerance);
  double previous = 0;
  for (int iteration = 1;; ++iteration) {
    preconditioned = residual;
    factor.solve_in_place(preconditioned.data());
    restrict_to_free(constraints, preconditioned);
    const double along = residual.cwiseProduct(preconditioned).sum();
    search = iteration == 1 ? preconditioned : Points(preconditioned + along / previous * search);
    previous = along;
    product.setZero();
    add_block_product(plan->pattern, values, 1.0, search, product);
    if (operator_.model == data::BendingModel::plate) {
      add_bending_correction(operator_, bending_rigidity, search, product);
      restrict_to_free(constraints, product);
    }
    const double step = along / search.cwiseProduct(product).sum();
    solution += step * search;
    residual -= step * product;
    if (residual.norm() <= target || iteration == 30) return iteration;
  }
}

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
  const BendingOperator& bending = w.bending_of(environment.material);
  update_grasps(environment, time);

  w.damping.clear();
  if (environment.material.stiffness_damping > 0) {
    w.damping.assign(9 * (w.plan->pattern.size + w.plan->pattern.pairs.size()), 0.0);
    add_elastic_hessian(*w.plan, bending, environment.material, start.positions,
                        environment.material.stiffness_damping / h, w.damping);
  }
  const StepProblem problem(*w.plan, bending, environment, h, w.damping);
  const double gravity = environment.gravity.norm() > 0 ? environment.gravity.norm() : 9.81;
  const double force_scale = problem.mass().norm() * gravity;

  Points x = start.positions + h * start.velocities;
  std::vector<VertexConstraint> constraints = begin_step(environment, time, x);
  Points force(x.rows(), 3), residual(x.rows(), 3), direction(x.rows(), 3), trial, trial_force(x.rows(), 3);
  ElasticEnergy elastic, trial_elastic;
  double potential = problem.evaluate(x, force, elastic);
  StepReport report;
  const auto judge = [&] {
    update_contacts(environment, time, h, x, force, constraints);
    report.penetration_max = report.complementarity = 0;
    for (int i = 0; i < x.rows(); ++i) {
      residual.row(i) = force.row(i) - constraints[i].reaction.transpose();
      if (constraints[i].hold == Hold::fixed) continue;
      report.penetration_max = std::max(report.penetration_max, -constraints[i].gap);
      if (constraints[i].hold != Hold::free)
        report.complementarity = std::max(report.complementarity, std::abs(constraints[i].gap));
    }
    report.residual = residual.norm() / force_scale;
    report.converged = report.residual <= w.settings.tolerance;
  };
  judge();
  while (!report.converged && report.iterations < w.settings.max_iterations) {
    ++report.iterations;
    problem.assemble(x, w.values);
    constrain(w.plan->pattern, constraints, w.values);
    const int solves = w.solve(bending, environment.material.bending_rigidity, constraints, -residual,
                               0.3 * w.settings.tolerance * force_scale, direction);
    if (solves == 0) break;
    report.solves += solves;
    report.factorizations += w.refactor;
    w.refactor = solves > w.settings.stale_factor_solves;

    const double before = potential + friction_potential(environment, time, h, constraints, x);
    const double slope = residual.cwiseProduct(direction).sum();
    double length = 1.0;
    for (int cut = 0;; ++cut) {
      trial = x + length * direction;
      project_to_feasible(environment, time, h, constraints, trial);
      const double trial_potential = problem.evaluate(trial, trial_force, trial_elastic);
      const double after = trial_potential + friction_potential(environment, time, h, constraints, trial);
      if (cut == 8 || after <= before + 1e-4 * length * slope + 1e-13 * std::abs(before)) {
        x.swap(trial);
        force.swap(trial_force);
        elastic = trial_elastic;
        potential = trial_potential;
        break;
      }
      length *= 0.5;
    }
    judge();
  }

  report.membrane = elastic.membrane;
  report.bending = elastic.bending;
  report.grasp_forces.assign(environment.grasps.size(), Vector3d::Zero());
  report.obstacle_forces.assign(environment.obstacles.size(), Vector3d::Zero());
  for (size_t i = 0; i < constraints.size(); ++i) {
    const VertexConstraint& c = constraints[i];
    if (c.hold == Hold::fixed)
      (c.grasp >= 0 ? report.grasp_forces[c.grasp] : report.fixed_force) += c.reaction;
    else if (c.hold != Hold::free)
      report.obstacle_forces[c.obstacle] += c.reaction;
  }
  environment.state.velocities = (x - start.positions) / h;
  environment.state.positions = x;
  environment.state.time = time;
  const Eigen::VectorXd& mass = problem.mass();
  report.kinetic =
      0.5 *
      (mass.asDiagonal() * environment.state.velocities).cwiseProduct(environment.state.velocities).sum();
  report.potential = -(mass.transpose() * x * environment.gravity)(0);
  return report;
}

}  // namespace flash::sim
