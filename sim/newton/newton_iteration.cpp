#include "sim/newton/newton_iteration.h"

#include <algorithm>
#include <cmath>

#include "sim/newton/active_set.h"
#include "sim/step/feasible_positions.h"
#include "sim/step/moving_obstacles.h"

namespace flash::sim {
namespace {

constexpr int coupled_after = 20;  ///< iterations of a part after which friction follows the normal forces
constexpr int layers_coupled_after = 3;  ///< iterations after which friction of layers may do so
constexpr int linear_problems = 6;  ///< an iteration, each with the contacts that the one before asks for
constexpr double linear_tolerance = 0.3;  ///< of a linear problem, as a share of the step's
/// Of the tolerance, for the place where a step starts to be taken for its end as it is. With the whole
/// tolerance forces below it would move nothing, however long they act.
constexpr double start_tolerance_share = 1e-3;
constexpr double armijo_share = 1e-4;   ///< of the decrease of the potential that the slope promises
constexpr double residual_share = 0.1;  ///< of the decrease of the residual that a full step promises
constexpr double least_length = 1e-3;   ///< down to which a step is halved
constexpr int most_forced_moves = 6;    ///< a step: moves that neither criterion accepts
constexpr double greatest_length = 30;  ///< up to which a step is lengthened
constexpr double flat_slope = 0.2;      ///< share of the first slope from which on a line is flat
constexpr double least_growth = 1.5, greatest_growth = 3.0;  ///< of a length at a time
constexpr double residual_growth = 10;  ///< of the residual by a lengthened step, at most

/// Whether layers rub on each other.
bool layers_rub(const StepProblem& problem) { return problem.layers && problem.layers->friction() > 0; }

/// Friction at the normal forces of the iterate converges where these change little. In the parts of a step
/// that could not be solved as one it goes round in circles at times. Then both are solved at once, guided by
/// the residual. Normal forces of layers change with every motion, so they are coupled in any step. But far
/// from its end the potential is the better guide: only where the last iteration went its whole way.
bool couples_friction(const StepProblem& problem, const SolverSettings& settings, int iterations,
                      bool went_whole) {
  if (layers_rub(problem)) return iterations > layers_coupled_after && went_whole;
  return problem.contacts.time_step < settings.time_step && iterations > coupled_after;
}

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

/// Factorizes the positive Hessian at w.now. Returns false where it is not positive definite after all.
bool factorize(const StepProblem& problem, NewtonWorkspace& w) {
  problem.potential.assemble(w.now.positions, Curvature::positive, false, w.values);
  for (const BodyLaw& law : problem.laws)
    add_bending_stand_in(law.bending, problem.potential.effective_rigidity(law), w.values);
  add_slip_stiffness(w.now.contacts, w.values);
  add_layer_diagonal(layer_stiffness(problem, w.now), w.values);
  restrict_matrix(w.plan->pattern, w.now.contacts, w.values);
  w.factored_springs = problem.potential.spring_stiffness();
  return w.matrix.factorize(w.values);
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
  const double small = linear_tolerance * std::min(w.settings.tolerance * lightest, w.now.residual.norm());
  w.linear = w.now.contacts;
  w.gradient = w.now.residual;
  w.refactor = false;
  for (int solved = 0; solved < linear_problems; ++solved) {
    w.force = w.now.force;
    const int solves = coupled
                           ? w.matrix.solve_coupled(w.linear, friction_couplings(problem.contacts, w.linear),
                                                    w.gradient, small, w.direction, w.force)
                           : w.matrix.solve(w.linear, w.gradient, small, solved > 0, w.direction, w.force);
    report.solves += solves;
    w.refactor = w.refactor || solves > w.settings.stale_factor_solves;
    // What holds in the last one has to be what its direction was found with.
    if (solved + 1 == linear_problems) return;
    const bool changed = stuck ? hold_touching(iterate, w.direction, w.linear)
                               : exchange_contacts(iterate, w.direction, w.force, w.gradient, w.linear);
    if (!changed) return;
  }
}

/// The way along w.direction from w.now.
struct SearchLine {
  const StepProblem& problem;
  const NewtonWorkspace& w;
  bool coupled;
  double potential, slope;  ///< of the step with friction, at its start [J]
};

/// A point on a search line, `length` directions from its start.
struct LinePoint {
  double length, potential;
};

/// The potential with that of friction at the normal forces of the line's start.
double potential_at(const StepProblem& problem, const Iterate& now, const Iterate& at) {
  const double potential =
      at.incremental_potential + friction_potential(problem.contacts, now.contacts, at.positions);
  return problem.layers ? potential + problem.layers->friction_potential(now.layers, at.positions)
                        : potential;
}

/// Evaluates the feasible iterate nearest to the point at `length`, or nearer where the surface would pass
/// through itself on the way.
LinePoint move(const SearchLine& line, double length, Iterate& to) {
  constexpr int most_cuts = 20;
  for (int cut = 0;; ++cut) {
    to.positions = line.w.now.positions + length * line.w.direction;
    project_to_feasible(line.problem.contacts, line.w.linear, to.positions);
    const double share =
        line.problem.layers ? line.problem.layers->free_share(line.w.now.positions, to.positions) : 1;
    if (share == 1) break;
    length *= share;
    if (cut < most_cuts) continue;
    to.positions = line.w.now.positions;
    break;
  }
  line.problem.evaluate(to);
  return {length, potential_at(line.problem, line.w.now, to)};
}

/// The potential guides the step. It is not exact where the surface is curved or the normal forces change.
/// Near the solution it falls by less than its rounding. So a smaller residual does as well.
bool acceptable(const SearchLine& line, const LinePoint& point, const Iterate& trial) {
  return (!line.coupled && point.potential <= line.potential + armijo_share * point.length * line.slope) ||
         trial.residual.norm() <= (1 - residual_share * point.length) * line.w.now.residual.norm();
}

/// Halves a whole step until it is acceptable or too short.
LinePoint line_search(const SearchLine& line, Iterate& trial) {
  LinePoint point = move(line, 1.0, trial);
  while (!acceptable(line, point, trial) && point.length > least_length)
    point = move(line, 0.5 * point.length, trial);
  return point;
}

/// Goes on along the line, by secants, while the potential falls. A sheet about to buckle needs it: the
/// matrix, made positive, is stiffer than the sheet, and steps are too short. Returns where it ends.
LinePoint lengthen(const SearchLine& line, LinePoint point, Iterate& trial, Iterate& longer) {
  while (point.length >= 1 && point.length < greatest_length) {
    const double end_slope = trial.residual.cwiseProduct(line.w.direction).sum();
    if (end_slope > flat_slope * line.slope) break;
    const double growth = std::clamp(line.slope / (line.slope - end_slope), least_growth, greatest_growth);
    const LinePoint further = move(line, point.length * growth, longer);
    if (further.potential >= point.potential ||
        !(longer.residual.norm() < residual_growth * line.w.now.residual.norm()))
      break;
    point = further;
    std::swap(trial, longer);
  }
  return point;
}

}  // namespace

void iterate_to_balance(const StepProblem& problem, int most_iterations, NewtonWorkspace& w,
                        StepReport& report) {
  const int first = report.iterations;
  w.longer.contacts = w.trial.contacts = w.now.contacts;
  bool stuck = false, went_whole = true;
  int forced_moves = 0;
  double tolerance = start_tolerance_share * w.settings.tolerance;
  while (report.iterations - first < most_iterations && !problem.balanced(w.now, tolerance)) {
    tolerance = w.settings.tolerance;
    ++report.iterations;
    // A spring may be a thousand times as stiff as what the factor has in its place.
    if (w.refactor || w.factored_springs != problem.potential.spring_stiffness()) {
      if (!factorize(problem, w)) return;
      ++report.factorizations;
    }
    const bool coupled =
        !stuck && couples_friction(problem, w.settings, report.iterations - first, went_whole);
    linear_step(problem, stuck, coupled, w, report);

    const SearchLine line{problem, w, coupled, potential_at(problem, w.now, w.now),
                          w.now.residual.cwiseProduct(w.direction).sum()};
    LinePoint point = line_search(line, w.trial);
    went_whole = point.length == 1;
    if (!acceptable(line, point, w.trial)) {
      if (problem.balanced(w.now, tolerance)) return;
      if (coupled && layers_rub(problem)) continue;
      if (!stuck) {
        // The iteration is repeated with a fresh factor and a positive matrix, whose direction leads down.
        stuck = w.refactor = true;
        continue;
      }
      // A small step all the same lets the contacts decide anew.
      if (++forced_moves > most_forced_moves || !std::isfinite(point.potential)) return;
    }
    stuck = false;
    if (!coupled) point = lengthen(line, point, w.trial, w.longer);
    if (problem.layers) problem.layers->carry_duals(w.now.layers, point.length, w.trial.layers);
    std::swap(w.now, w.trial);
  }
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
