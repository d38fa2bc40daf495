#pragma once
#include <memory>

#include "sim/newton/newton_iteration.h"
#include "tests/prototype/row_layers.h"
#include "tests/prototype/row_matrix.h"

namespace flash::sim {

/// How pairs of features are kept apart, where no barrier does it.
enum class RowMethod {
  multipliers,  ///< unknowns of each linear problem: primal-dual active set (Hintermueller, Ito, Kunisch
                ///< 2003)
  augmented,    ///< of an augmented Lagrangian, renewed once its minimum is found (Uzawa)
};

/// Largest violation of a row in a step that is solved, as a share of the thickness.
inline constexpr double row_tolerance = 1e-3;

/// Solver with hard rows d >= t between layers in place of the barrier: a prototype to compare with.
/// Potential, obstacles, holds, friction, detection of ways, tolerance and halves of a step are those of
/// Solver.
class RowSolver {
 public:
  RowSolver(const Sheet& sheet, RowMethod method, const SolverSettings& settings);

  /// Advances environment.state by one time step. An unconverged step is reported.
  StepReport step(Environment& environment);

  /// How layers touch at the end of the last step, or of its last part.
  const LayerContact& layers() const { return w_.now.layers; }

 private:
  // As the functions of Solver that are called alike.
  StepReport advance(Environment& environment, double h, int halvings);
  bool try_step(Environment& environment, double h, StepReport& report);
  bool start_search(const StepProblem& problem);

  /// The penalty with which a step starts: the barrier's pressure over the thickness, for an augmented
  /// Lagrangian. For multipliers, where it only decides which rows press, the mass over the area and h^2.
  double first_penalty(const StepProblem& problem) const;
  bool solved(const StepProblem& problem, double share = 1) const;

  /// Goes from w_.now towards the end of the step, by the method.
  void balance(const StepProblem& problem, int most_iterations, StepReport& report);
  void augment(const StepProblem& problem, int most_iterations, StepReport& report);
  void iterate_with_rows(const StepProblem& problem, int most_iterations, StepReport& report);

  // An iteration with rows.
  bool factorize(const StepProblem& problem);
  void assemble(const StepProblem& problem);
  void solve_rows(const StepProblem& problem, StepReport& report);
  /// To w_.trial, as far along w_.direction as is free. Returns how far.
  double move(const StepProblem& problem);

  RowMethod method_;
  NewtonWorkspace w_;
  RowMatrix matrix_;
  PairMultipliers multipliers_;
  double thickness_ = 0;
  Eigen::VectorXd forces_;  ///< of the rows, that the last linear problem adds
};

}  // namespace flash::sim
