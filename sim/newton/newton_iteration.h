#pragma once
#include <memory>
#include <optional>
#include <utility>

#include "sim/newton/newton_matrix.h"
#include "sim/newton/solver_settings.h"
#include "sim/newton/step_problem.h"
#include "sim/newton/step_report.h"

namespace flash::sim {

/// What the solver of one environment keeps between steps.
struct NewtonWorkspace {
  std::shared_ptr<const SheetPlan> plan;
  SolverSettings settings;
  NewtonMatrix matrix;
  std::optional<LayerMemory> layers;  ///< made where the surface first meets itself
  bool refactor = true;  ///< whether the next solve needs a new factor: none yet, or the sheet has moved on
  data::Points factored_springs;  ///< those that the factor knows, as IncrementalPotential tells them
  Iterate now;                    ///< where the iteration stands; between steps the end of the last one
  // These members stay between steps to reuse their memory.
  Iterate trial, longer;
  BlockValues<double> values;
  ContactSet linear;  ///< contacts of the linear problem, to which `direction` is the solution
  data::Points gradient, force, direction;

  NewtonWorkspace(std::shared_ptr<const SheetPlan> plan_in, const SolverSettings& settings_in)
      : plan(std::move(plan_in)), settings(settings_in), matrix(plan) {}
};

/// Semi-smooth Newton's method from w.now, which is feasible, to balance or until it cannot go on. Counts its
/// work in `report`.
void iterate_to_balance(const StepProblem& problem, int most_iterations, NewtonWorkspace& w,
                        StepReport& report);

/// Takes what holds carry from where w.now has it to its places, or as far as layers are not in its way. The
/// rest of the surface follows as the matrix says. Returns whether it arrives.
bool carry_on(const StepProblem& problem, NewtonWorkspace& w, StepReport& report);

}  // namespace flash::sim
