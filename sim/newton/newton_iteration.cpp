#include "sim/newton/newton_iteration.h"

#include <algorithm>
#include <cmath>

#include "sim/newton/active_set.h"
#include "sim/newton/newton_loop.h"
#include "sim/newton/step_end.h"
#include "sim/step/feasible_positions.h"
#include "sim/step/moving_obstacles.h"

namespace flash::sim {
namespace {

constexpr int layers_coupled_after = 3;  ///< iterations after which friction of layers may do so

constexpr double least_raise = 1e-6;  ///< of a diagonal that is not positive in single precision

/// Whether layers rub on each other.
bool layers_rub(const StepProblem& problem) { return problem.layers && problem.layers->friction() > 0; }

/// The stiffness of all touches of layers at an iterate; `coupled`: with friction that grows with the normal
/// forces.
std::vector<TouchStiffness> layer_stiffness(const StepProblem& problem, const Iterate& iterate,
                                            bool coupled = false) {
  std::vector<TouchStiffness> all;
  if (!problem.layers) return all;
  const double friction = problem.layers->friction();
  all.reserve(iterate.layers.touches.size());
  for (const LayerTouch& touch : iterate.layers.touches)
    all.push_back({touch, stiffness_of(touch, friction, problem.layers->time_step()),
                   coupled ? friction_coupling_of(touch, friction) : Vector3<double>{}});
  return all;
}

/// Adds what layers that touch add to the blocks of their vertices. Those between them are not in the
/// pattern.
void add_layer_diagonal(const std::vector<TouchStiffness>& layers, BlockValues<double>& values) {
  for (const TouchStiffness& layer : layers) {
    const Eigen::Matrix3d stiffness = matrix3d(layer.stiffness);
    for (int k = 0; k < 4; ++k) {
      const double weight = layer.touch.weights[k];
      Eigen::Map<Eigen::Matrix3d>(values.data() + 9L * layer.touch.vertices[k]) +=
          weight * weight * stiffness;
    }
  }
}

/// Raises the diagonal of each vertex by a share of its largest entry.
void raise_diagonal(const BlockPattern& pattern, double share, BlockValues<double>& values) {
  for (long i = 0; i < pattern.size; ++i) {
    Eigen::Map<Eigen::Matrix3d> block(values.data() + 9 * i);
    block.diagonal().array() += share * block.diagonal().maxCoeff();
  }
}

/// Factorizes the positive Hessian at w.now. Where the inertia is lost in the rounding of the stiffness, its
/// diagonal is raised: it is a preconditioner alone. Returns false where it is not positive definite after
/// all.
bool factorize(const StepProblem& problem, NewtonWorkspace& w) {
  problem.potential.assemble(w.now.positions, Curvature::positive, false, w.values);
  for (const BodyLaw& law : problem.laws)
    add_bending_stand_in(law.bending, problem.potential.effective_rigidity(law), w.values);
  add_slip_stiffness(w.now.contacts, w.values);
  add_layer_diagonal(layer_stiffness(problem, w.now), w.values);
  restrict_matrix(w.plan->pattern, w.now.contacts, w.values);
  w.factored_springs = problem.potential.spring_stiffness();
  if (w.matrix.factorize(w.values)) return true;
  for (double share = least_raise; share < 1; share *= 10) {
    raise_diagonal(w.plan->pattern, share, w.values);
    if (w.matrix.factorize(w.values)) return true;
  }
  return false;
}

/// Assembles the Hessian at w.now as the matrix of the linear problem: exact, or `positive`. `coupled`: with
/// friction of layers that grows with their normal forces, so that it is not symmetric.
void assemble_matrix(const StepProblem& problem, bool positive, bool coupled, NewtonWorkspace& w) {
  const double h = problem.contacts.time_step;
  bool sparse = true;
  std::vector<ScaledBending> bending;
  for (const BodyLaw& law : problem.laws) {
    if (law.solid != nullptr) continue;
    sparse = sparse && !law.bends_at_hinges();
    bending.push_back({law.bending, problem.potential.effective_rigidity(law)});
  }
  problem.potential.assemble(w.now.positions, positive ? Curvature::positive : Curvature::exact, sparse,
                             w.values);
  add_slip_stiffness(w.now.contacts, w.values);
  if (!positive) add_surface_curvature(w.now.contacts, w.values);
  w.matrix.assign(w.values, sparse, bending, problem.potential.mass().minCoeff() / (h * h),
                  layer_stiffness(problem, w.now, coupled));
}

/// Finds w.direction and the contacts that go with it, w.linear: solves the linear problem and exchanges its
/// contacts in turn. `stuck`: with the positive Hessian, whose direction leads down.
void linear_step(const StepProblem& problem, bool stuck, bool coupled, NewtonWorkspace& w,
                 StepReport& report) {
  assemble_matrix(problem, stuck, coupled, w);
  const Linearization iterate{problem.contacts, w.now.positions, w.now.force, w.now.residual};
  const double lightest = *std::min_element(problem.force_scales.begin(), problem.force_scales.end());
  const double small = linear_target(w.settings.tolerance * lightest, w.now.residual.norm());
  w.linear = w.now.contacts;
  w.gradient = w.now.residual;
  w.refactor = false;
  solve_and_exchange(
      [&](int solved) {
        w.force = w.now.force;
        const int solves =
            coupled ? w.matrix.solve_coupled(w.linear, friction_couplings(problem.contacts, w.linear),
                                             w.gradient, small, w.direction, w.force)
                    : w.matrix.solve(w.linear, w.gradient, small, solved > 0, w.direction, w.force);
        report.solves += solves;
        w.refactor = w.refactor || solves > w.settings.stale_factor_solves;
      },
      [&] {
        return stuck ? hold_touching(iterate, w.direction, w.linear)
                     : exchange_contacts(iterate, w.direction, w.force, w.gradient, w.linear);
      });
}

/// The potential with that of friction at the normal forces of the line's start.
double potential_at(const StepProblem& problem, const Iterate& now, const Iterate& at) {
  const double potential =
      at.incremental_potential + friction_potential(problem.contacts, now.contacts, at.positions);
  return problem.layers ? potential + problem.layers->friction_potential(now.layers, at.positions)
                        : potential;
}

/// A point on a search line.
struct PointOnLine {
  double length, potential, residual;
};

/// Evaluates the feasible iterate nearest to the point `length` directions from w.now, or nearer where the
/// surface would pass through itself on the way.
PointOnLine move(const StepProblem& problem, const NewtonWorkspace& w, double length, Iterate& to) {
  constexpr int most_cuts = 20;
  for (int cut = 0;; ++cut) {
    to.positions = w.now.positions + length * w.direction;
    project_to_feasible(problem.contacts, w.linear, to.positions);
    const double share = problem.layers ? problem.layers->free_share(w.now.positions, to.positions) : 1;
    if (share == 1) break;
    length *= share;
    if (cut < most_cuts) continue;
    to.positions = w.now.positions;
    break;
  }
  problem.evaluate(to);
  return {length, potential_at(problem, w.now, to), to.residual.norm()};
}

/// What iterate (newton_loop.h) asks of the processor.
struct NewtonStep {
  const StepProblem& problem;
  NewtonWorkspace& w;
  StepReport& report;
  int most;  ///< iterations
  PointOnLine start{}, trial{}, second{};

  int most_iterations() const { return most; }
  bool rests() const { return problem.rests(w.now, w.settings.tolerance); }
  bool balanced() const { return problem.balanced(w.now, w.settings.tolerance); }
  bool begin_iteration() {
    ++report.iterations;
    // A spring may be a thousand times as stiff as what the factor has in its place.
    if (!w.refactor && w.factored_springs == problem.potential.spring_stiffness()) return true;
    if (!factorize(problem, w)) return false;
    ++report.factorizations;
    return true;
  }
  /// Normal forces of layers change with every motion, so they are coupled in any step. But far from its end
  /// the potential is the better guide: only where the last iteration went its whole way.
  bool couples(int iterations, bool whole) const {
    if (layers_rub(problem)) return iterations > layers_coupled_after && whole;
    return couples_friction(problem.contacts.time_step, w.settings.time_step, iterations);
  }
  void find_direction(bool stuck, bool coupled) {
    linear_step(problem, stuck, coupled, w, report);
    start = {0, potential_at(problem, w.now, w.now), w.now.residual.norm()};
  }
  double slope() const { return w.now.residual.cwiseProduct(w.direction).sum(); }
  bool repeats(bool coupled) const { return coupled && layers_rub(problem); }
  void renew() { w.refactor = true; }
  void go_to_trial(double length) {
    if (problem.layers) problem.layers->carry_duals(w.now.layers, length, w.trial.layers);
    std::swap(w.now, w.trial);
  }

  double start_potential() const { return start.potential; }
  double start_residual() const { return start.residual; }
  double trial_potential() const { return trial.potential; }
  double trial_residual() const { return trial.residual; }
  bool trial_is_finite() const { return std::isfinite(trial.potential); }
  double second_potential() const { return second.potential; }
  double second_residual() const { return second.residual; }
  double end_slope() const { return w.trial.residual.cwiseProduct(w.direction).sum(); }
  double move(double length) {
    trial = sim::move(problem, w, length, w.trial);
    return trial.length;
  }
  double move_second(double length) {
    second = sim::move(problem, w, length, w.longer);
    return second.length;
  }
  void take_second() {
    std::swap(w.trial, w.longer);
    std::swap(trial, second);
  }
};

}  // namespace

void iterate_to_balance(const StepProblem& problem, int most_iterations, NewtonWorkspace& w,
                        StepReport& report) {
  w.longer.contacts = w.trial.contacts = w.now.contacts;
  NewtonStep step{problem, w, report, most_iterations};
  iterate(step);
}

bool carry_on(const StepProblem& problem, NewtonWorkspace& w, StepReport& report) {
  constexpr int most_cuts = 20;
  const auto set_corrections = [&](const data::Points* places) {
    for (std::size_t k = 0; k < w.now.contacts.held; ++k) {
      VertexConstraint& held = w.now.contacts.constraints[k];
      const Eigen::Index i = held.vertex;
      held.correction =
          places == nullptr ? Vector3<double>{} : vector3(*places, i) - vector3(w.now.positions, i);
    }
  };
  data::Points places = w.now.positions;
  begin_step(problem.contacts, places);
  ++report.iterations;
  ++report.factorizations;
  if (!factorize(problem, w)) return false;
  set_corrections(&places);
  linear_step(problem, true, false, w, report);
  set_corrections(nullptr);
  w.trial.contacts = w.now.contacts;
  double length = 1;
  for (int cut = 0; cut < most_cuts; ++cut) {
    w.trial.positions = w.now.positions + length * w.direction;
    if (length == 1) begin_step(problem.contacts, w.trial.positions);
    project_to_feasible(problem.contacts, w.now.contacts, w.trial.positions);
    const double share = problem.layers->free_share(w.now.positions, w.trial.positions);
    if (share == 1) {
      problem.evaluate(w.trial);
      problem.layers->carry_duals(w.now.layers, length, w.trial.layers);
      std::swap(w.now, w.trial);
      return length == 1;
    }
    length *= share;
  }
  return false;
}

}  // namespace flash::sim
